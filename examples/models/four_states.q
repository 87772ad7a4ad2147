// We can win, whatever the opponent does.
// EXPECT:T
control: A<> Main.Won

// We cannot win if we let the first 3 units pass: then the opponent can throw us out.
// EXPECT:F
control: A[ not (Main.Middle && x < 3) U Main.Won ]
