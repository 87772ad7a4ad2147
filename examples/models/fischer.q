// Two processes are never in the critical section at once.
// EXPECT:T
A[] forall (i : number) forall (j : number) P(i).Critical && P(j).Critical imply i == j

// Each process can enter it.
// EXPECT:T
E<> P(1).Critical

// No process is sure to enter it: another one can always be quicker.
// EXPECT:F
P(1).Request --> P(1).Critical
