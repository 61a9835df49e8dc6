"""The tab Play: which sequence is played, and a camera or stream that is live."""
