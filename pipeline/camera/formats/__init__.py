"""Camera files of other programs: first what they hold as plain Python values, then the cameras in it."""
