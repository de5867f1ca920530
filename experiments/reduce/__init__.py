"""The smallest scene on which a renderer still fails as it did."""
