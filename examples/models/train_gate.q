// Two trains never cross at the same time.
// EXPECT:T
A[] forall (i : train) forall (j : train) Train(i).Crossing && Train(j).Crossing imply i == j

// A train that comes will cross at some time.
// EXPECT:T
Train(0).Approaching --> Train(0).Crossing

// One train can cross while the other one waits.
// EXPECT:T
E<> Train(0).Crossing && Train(1).Stopped

// The system never gets stuck.
// EXPECT:T
A[] not deadlock
