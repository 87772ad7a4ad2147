// queries: 16
/*
A comment of a query.
*/
E<> P.goal and x > 3
A[] not deadlock
E[] true
A<> forall (i : int[0, 3]) P(i).done
P.a --> P.b
sup{P.a}: x, y - x
inf: x
bounds{true}: P.n
control: A[ not P.bad U P.goal ]
strategy S = control: A[] (p && A<> q)
E<> control: A<> P.goal
{ P.a, x >= 2 } control: A[] \
    not P.bad
control_t*(20, x): A<> P.goal
A[] x < 3 under S
saveStrategy("s.json", S)
strategy T = loadStrategy("s.json")
