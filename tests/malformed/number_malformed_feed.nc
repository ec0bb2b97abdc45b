F.
