"""RTP as vehicles send it to a UDP port: received here, so that each lost packet is known, and decoded by FFmpeg."""
