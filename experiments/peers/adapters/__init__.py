"""Scripts that peers' own Pythons run, each alone: a description in, an image out. They import `plain`, not Nusselt."""
