E<> Die.Done && d == 6
A[] !Die.Done imply d == 0
Pr[#<=20](<> Die.Done && d == 1)
Pr[#<=3](<> Die.Done)
