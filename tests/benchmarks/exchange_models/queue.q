Pr[<=2](<> n == 5)
Pr[<=10](<> n == 5 && Server.Busy)
