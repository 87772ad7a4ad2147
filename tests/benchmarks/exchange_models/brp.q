E<> Sender.Failed
A[] !(Sender.Done && Sender.Failed)
Pr[#<=200](<> Sender.Failed)
Pr[#<=200](<> Sender.Done)
