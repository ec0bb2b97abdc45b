F600
MSG("half
