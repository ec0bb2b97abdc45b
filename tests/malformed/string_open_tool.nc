T="FR_4
