//! A family of timed games that grows.

/// Trains that come to a bridge when they like, and a gate that can stop them for a while. `arrow`
/// says who lets them come: `->` or `-u->`.
pub(crate) fn trains(count: usize, arrow: &str) -> String {
    format!(
        "const int N = {count};
typedef int[0, N - 1] id_t;
chan stop[N], go[N];
process Train(const id_t id) {{
  clock x;
  state Away, Near {{ x <= 20 }}, Stopped, Starting {{ x <= 15 }}, Bridge {{ x <= 5 }};
  init Away;
  trans Away {arrow} Near {{ assign x = 0; }},
        Near -u-> Bridge {{ guard x >= 10; assign x = 0; }},
        Near -> Stopped {{ guard x <= 10; sync stop[id]?; }},
        Stopped -> Starting {{ sync go[id]?; assign x = 0; }},
        Starting -u-> Bridge {{ guard x >= 7; assign x = 0; }},
        Bridge -u-> Away {{ guard x >= 3; }};
}}
process Gate() {{
  state Any;
  init Any;
  trans Any -> Any {{ select e : id_t; sync stop[e]!; }},
        Any -> Any {{ select e : id_t; sync go[e]!; }};
}}
system Train, Gate;
"
    )
}

/// That no two trains are on the bridge.
pub(crate) const ONE_ON_THE_BRIDGE: &str = "control: A[] forall (i : id_t) forall (j : id_t) \
                                     (Train(i).Bridge && Train(j).Bridge imply i == j)";
