"""What is asked, measured, judged and shown."""
