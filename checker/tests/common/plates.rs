//! A game with many zones for each discrete state.

/// Some plates on poles, one pair of hands: each is to be spun again within so many units after it
/// began to shake, which takes one. A few thousand states have many zones for each discrete state,
/// of which there are few. With all that invariants allow, the plates may have been left alone for
/// any time, and where they are lost falls into ever more pieces.
///
/// `[steady, shaking, falling]` are when a plate may begin to shake, when it must have been spun,
/// and when it may fall.
pub(crate) fn plates(count: usize, [steady, shaking, falling]: [i32; 3]) -> String {
    format!(
        "const int N = {count};
typedef int[0, N - 1] id_t;
bool hands;
process Plate(const id_t id) {{
  clock x;
  state Steady, Shaking {{ x <= {shaking} }}, Spun {{ x <= 1 }}, Fallen;
  init Steady;
  trans Steady -u-> Shaking {{ guard x >= {steady}; }},
        Steady -> Spun {{ guard !hands; assign hands = true, x = 0; }},
        Shaking -> Spun {{ guard !hands; assign hands = true, x = 0; }},
        Spun -> Steady {{ guard x >= 1; assign hands = false, x = 0; }},
        Shaking -u-> Fallen {{ guard x >= {falling}; }};
}}
system Plate;
"
    )
}

/// That no plate ever falls.
pub(crate) const NONE_FALLEN: &str = "control: A[] forall (i : id_t) not Plate(i).Fallen";
