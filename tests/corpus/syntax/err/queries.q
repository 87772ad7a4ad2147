x > 3
E <> p
A[] A<> p
control: E<> p
control: A[ p q ]
strategy S = E<> p
E<> p &&
E<> (p
E<> p )
A[] p under
P.a --> 
sup{p: x
/* EXPECT:whatever */ E<> p
inf:
E<> for all
E<> P.a ?
minPr(c)[<=3]: <> p
minE(c)[<=3]: [] p
minE[<=3]: <> p
minE(c)[<=3]
// expect: W0105 at 13:1 "`whatever` is not an expectation"
// expect: E0140 at 1:1 "this query has no path quantifier"
// expect: E0105 at 2:3 "a path quantifier is one word"
// expect: E0141 at 3:5 "`A<>` inside another formula"
// expect: E0142 at 4:10 "this is not an objective of a game"
// expect: E0105 at 5:15 "expected `U` or `W` inside `A[ … ]`, found `q`"
// expect: E0143 at 6:14 "this query gives no strategy"
// expect: E0105 at 7:9 "expected an expression, found the end of the text"
// expect: E0105 at 8:7 "expected `)` to close the parenthesis, found the end of the text"
// expect: E0105 at 9:7 "expected the end of the query, found `)`"
// expect: E0105 at 10:12 "expected the name of a strategy, found the end of the text"
// expect: E0105 at 11:8 "expected an expression, found the end of the text"
// expect: E0105 at 12:6 "expected `}` after the predicate, found `:`"
// expect: E0105 at 14:5 "expected an expression, found the end of the text"
// expect: E0105 at 15:9 "expected the end of the query, found `all`"
// expect: E0105 at 16:9 "expected the end of the query, found `?`"
// expect: E0145 at 17:1 "`minPr` has no expression: it is for the probability of `<> p`"
// expect: E0146 at 18:15 "a run ends where the goal behind `<>` holds, but this is `[]`"
// expect: W0108 at 19:1 "this has no expression, so each unit of time costs 1"
// expect: W0109 at 20:13 "this has no goal, so a run ends at its bound only"
