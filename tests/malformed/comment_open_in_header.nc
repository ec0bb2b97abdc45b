%MPF (open
