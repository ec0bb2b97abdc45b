                                                                                                    X1
