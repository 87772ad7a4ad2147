//! Properties of the operations on zones and federations. They are compared with sets of points,
//! with the same operations in 64 bits, and with their own results when nothing stops them.

mod cancellation;
mod limits;
mod points;
