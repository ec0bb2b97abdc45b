A B:
