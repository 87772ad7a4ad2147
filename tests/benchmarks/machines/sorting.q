E<> core.Trapped
A[] core.Halted imply sorted()
E<> core.Halted && !sorted()
A[] at <= 27
A<> core.Halted || core.Trapped
core.Runs && flips == 1 --> core.Halted || core.Trapped
A[] deadlock imply core.Halted || core.Trapped
