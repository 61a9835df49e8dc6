"""What works on the pixels of a picture: bright ones, the groups that they form, their peaks and squares."""
