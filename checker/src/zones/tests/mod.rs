//! Properties of the operations on zones and federations, against sets of points, against the same
//! in 64 bits, and against what they do when nobody stops them.

mod cancellation;
mod limits;
mod points;
