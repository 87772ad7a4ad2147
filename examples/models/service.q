// A long queue is possible.
// EXPECT:T
E<> waiting >= 15

// It is not likely within ten units of time.
// EXPECT:F
Pr[<=10](<> waiting >= 15) >= 0.1

// A queue of five is.
// EXPECT:T
Pr[<=10](<> waiting >= 5) >= 0.5

// How likely is it?
Pr[<=10](<> waiting >= 5)

// How long is the queue at its longest?
E[<=10; 1000](max: waiting)
