"""What the instrument itself does to every measurement; no effect of nature."""
