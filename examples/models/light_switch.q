// The light can become bright.
// EXPECT:T
E<> Light.Bright

// It becomes bright only within 5 units of the first press. x goes on after that.
// EXPECT:F
A[] Light.Bright imply x < 5

// Nobody has to press: the light may stay dim for ever.
// EXPECT:F
Light.Dim --> Light.Bright
