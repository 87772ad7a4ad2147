E<> Sender.Ok
Pr[<=5](<> Sender.Ok)
