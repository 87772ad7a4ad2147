E<> Gambler.Won
Pr[#<=300](<> Gambler.Won)
maxPr[#<=300]: <> Gambler.Won
minPr[#<=300]: <> Gambler.Won
