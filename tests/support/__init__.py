"""What several test modules share: arms, tasks that are possible by construction, an independent check, brute force."""
