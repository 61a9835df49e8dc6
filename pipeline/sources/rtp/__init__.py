"""RTP as vehicles send it to a UDP port: received here, so that each lost packet is known, and decoded by FFmpeg."""

from dockpose.sources.rtp.capture import RtpCapture

__all__ = ["RtpCapture"]
