E<> sender.Done && !is_copied()
A[] received <= WORDS
E<> faults == FAULTS && sender.Done
A<> sender.Done
sender.Waits --> sender.Sends
A[] deadlock imply sender.Done
