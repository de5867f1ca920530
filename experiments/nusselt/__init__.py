"""Is a direct-lighting renderer right, and how sure are we?"""
