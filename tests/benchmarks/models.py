"""The timed automata that are explored for measuring, written as XTA.

Each function returns the text of a model. Those with a namesake among the example generators of
TChecker are the same automata, edge by edge, so that the counts of both tools can be compared;
the others are written for counts of their own.
"""

from __future__ import annotations


def fischer(processes: int, delay: int = 10) -> str:
    """Fischer's mutual exclusion: who waits waits longer than any other may take to write."""
    return f"""
const int N = {processes};
const int K = {delay};
int[0, N] id;

process P(const int[1, N] pid) {{
    clock x;
    state idle, request {{ x <= K }}, waiting, critical;
    init idle;
    trans
        idle -> request {{ guard id == 0; assign x = 0; }},
        request -> waiting {{ guard x <= K; assign x = 0, id = pid; }},
        waiting -> request {{ guard id == 0; assign x = 0; }},
        waiting -> critical {{ guard x > K && id == pid; }},
        critical -> idle {{ assign id = 0; }};
}}
system P;
"""


def csmacd(stations: int, transmission: int = 808, propagation: int = 26) -> str:
    """Stations on one bus that detect collisions; it tells them one by one, committed."""
    return f"""
const int N = {stations};
const int L = {transmission};
const int S = {propagation};
chan begin, busy, end, collision[N + 1];

process Bus() {{
    int[1, N + 1] next = 1;
    clock y;
    state idle, active, colliding {{ y < S }}, telling;
    commit telling;
    init idle;
    trans
        idle -> active {{ sync begin?; assign y = 0; }},
        active -> colliding {{ guard y < S; sync begin?; assign y = 0; }},
        active -> active {{ guard y >= S; sync busy?; }},
        active -> idle {{ sync end?; assign y = 0; }},
        colliding -> telling {{ guard y < S; assign next = 1; }},
        telling -> idle {{ guard next == N + 1 && y < S; assign y = 0, next = 1; }},
        telling -> telling {{ guard next <= N; sync collision[next - 1]!;
            assign next = next + 1; }};
}}

process Station(const int[1, N] pid) {{
    clock x;
    state waiting, sending {{ x <= L }}, retrying {{ x < 2 * S }};
    init waiting;
    trans
        waiting -> sending {{ sync begin!; assign x = 0; }},
        waiting -> retrying {{ sync busy!; assign x = 0; }},
        waiting -> waiting {{ sync collision[pid - 1]?; assign x = 0; }},
        waiting -> retrying {{ sync collision[pid - 1]?; assign x = 0; }},
        sending -> waiting {{ guard x == L; sync end!; assign x = 0; }},
        sending -> retrying {{ guard x < S; sync collision[pid - 1]?; assign x = 0; }},
        retrying -> sending {{ guard x < 2 * S; sync begin!; assign x = 0; }},
        retrying -> retrying {{ guard x < 2 * S; sync busy!; assign x = 0; }},
        retrying -> retrying {{ guard x < 2 * S; sync collision[pid - 1]?; assign x = 0; }};
}}
system Bus, Station;
"""


def train_gate(trains: int) -> str:
    """Trains before a bridge, stopped and let go by a gate that keeps them in a ring buffer."""
    return f"""
const int N = {trains};
chan appr[N + 1], stop[N + 1], go[N + 1], leave[N + 1];

process Gate() {{
    int[1, N] buffer[N] = {{ {", ".join(["1"] * trains)} }};
    int[0, N - 1] head;
    int[0, N] length;
    state free, occupied, transient;
    commit transient;
    init free;
    trans
        free -> occupied {{ select e : int[1, N]; guard length > 0 && buffer[head] == e;
            sync go[e]!; }},
        free -> occupied {{ select e : int[1, N]; guard length == 0; sync appr[e]?;
            assign buffer[(head + length) % N] = e, length = length + 1; }},
        occupied -> transient {{ select e : int[1, N]; sync appr[e]?;
            assign buffer[(head + length) % N] = e, length = length + 1; }},
        occupied -> free {{ select e : int[1, N]; guard length > 0 && buffer[head] == e;
            sync leave[e]?; assign head = (head + 1) % N, length = length - 1; }},
        transient -> occupied {{ select e : int[1, N];
            guard length > 0 && buffer[(head + length - 1) % N] == e; sync stop[e]!; }};
}}

process Train(const int[1, N] pid) {{
    clock x;
    state safe, approaching {{ x <= 20 }}, stopped, starting {{ x <= 15 }}, crossing {{ x <= 5 }};
    init safe;
    trans
        safe -> approaching {{ sync appr[pid]!; assign x = 0; }},
        approaching -> crossing {{ guard x >= 10; assign x = 0; }},
        approaching -> stopped {{ guard x <= 10; sync stop[pid]?; }},
        stopped -> starting {{ sync go[pid]?; assign x = 0; }},
        starting -> crossing {{ guard x >= 7; assign x = 0; }},
        crossing -> safe {{ guard x >= 3; sync leave[pid]!; }};
}}
system Gate, Train;
"""


def dining_philosophers(philosophers: int, timeout: int = 3, eating: int = 10) -> str:
    """Philosophers who put the left fork back after a while, so that there is no deadlock."""
    return f"""
const int N = {philosophers};
const int TIMEOUT = {timeout};
const int EAT = {eating};
chan take[N], release[N];

process Philosopher(const int[1, N] pid) {{
    clock x;
    state idle, acquiring {{ x <= TIMEOUT }}, eating {{ x <= EAT }}, releasing {{ x <= 0 }};
    init idle;
    trans
        idle -> acquiring {{ sync take[(pid + N - 2) % N]!; assign x = 0; }},
        acquiring -> idle {{ guard x >= TIMEOUT; sync release[(pid + N - 2) % N]!; }},
        acquiring -> eating {{ guard x <= TIMEOUT; sync take[pid - 1]!; assign x = 0; }},
        eating -> releasing {{ guard x >= EAT; sync release[pid - 1]!; assign x = 0; }},
        releasing -> idle {{ sync release[(pid + N - 2) % N]!; }};
}}

process Fork(const int[0, N - 1] f) {{
    state free, taken;
    init free;
    trans
        free -> taken {{ sync take[f]?; }},
        taken -> free {{ sync release[f]?; }};
}}
system Philosopher, Fork;
"""


def fddi(stations: int, rotation: int | None = None, synchronous: int = 20, delay: int = 0) -> str:
    """A token ring; each station measures the rotation of the token with three clocks."""
    rotation = 50 * stations if rotation is None else rotation
    waiting = ", ".join(f"q{i} {{ t <= TD }}, r{i}" for i in range(1, stations + 1))
    edges = ",\n        ".join(
        f"q{i} -> r{i} {{ guard t == TD; sync take[{i - 1}]!; }},\n"
        f"        r{i} -> q{i % stations + 1} {{ sync give[{i - 1}]?; assign t = 0; }}"
        for i in range(1, stations + 1)
    )
    return f"""
const int N = {stations};
const int TTRT = {rotation};
const int SA = {synchronous};
const int TD = {delay};
chan take[N], give[N];

process Station(const int[0, N - 1] i) {{
    clock rotation, a, b;
    state q0, q1 {{ rotation <= SA }}, q2 {{ rotation <= SA }}, q3 {{ a <= TTRT + SA }},
        q4, q5 {{ rotation <= SA }}, q6 {{ rotation <= SA }}, q7 {{ b <= TTRT + SA }};
    init q0;
    trans
        q0 -> q1 {{ guard rotation >= TTRT; sync take[i]?; assign rotation = 0, b = 0; }},
        q0 -> q2 {{ guard rotation < TTRT; sync take[i]?; assign rotation = 0, b = 0; }},
        q1 -> q4 {{ guard rotation == SA; sync give[i]!; }},
        q2 -> q3 {{ guard rotation == SA; }},
        q3 -> q4 {{ sync give[i]!; }},
        q4 -> q5 {{ guard rotation >= TTRT; sync take[i]?; assign rotation = 0, a = 0; }},
        q4 -> q6 {{ guard rotation < TTRT; sync take[i]?; assign rotation = 0, a = 0; }},
        q5 -> q0 {{ guard rotation == SA; sync give[i]!; }},
        q6 -> q7 {{ guard rotation == SA; }},
        q7 -> q0 {{ sync give[i]!; }};
}}

process Ring() {{
    clock t;
    state {waiting};
    init q1;
    trans
        {edges};
}}
system Station, Ring;
"""


def corsso(users: int, shortest: int = 2, longest: int = 10) -> str:
    """Users who collect certificates for one of two policies, in time, and then have access."""
    return f"""
const int N = {users};
const int POLICIES = 2;
const int NEEDED[POLICIES] = {{ 1, 2 }};
const int MOST = 2;

process User(const int[1, N] pid) {{
    clock certifying, collecting;
    int[0, MOST + 1] certificates;
    int[0, MOST + 1] policy;
    state authenticating, access;
    init authenticating;
    trans
        authenticating -> authenticating {{ select p : int[1, POLICIES]; guard policy == 0;
            assign policy = p, certificates = 0, certifying = 0, collecting = 0; }},
        authenticating -> authenticating {{
            guard policy > 0 && certifying > {shortest} && certificates < MOST;
            assign certificates = certificates + 1, certifying = 0; }},
        authenticating -> access {{ select p : int[1, POLICIES];
            guard collecting < {longest} && policy == p && certificates >= NEEDED[p - 1]; }},
        access -> authenticating {{ assign policy = 0; }};
}}
system User;
"""


def peterson(processes: int) -> str:
    """Peterson's algorithm for several processes, without clocks: each climbs a ladder."""
    return f"""
const int N = {processes};
int[0, N - 1] level[N];
int[0, N - 1] last[N];

process P(const int[0, N - 1] pid) {{
    int[0, N - 1] rung;
    int[0, N] other;
    state outside, claiming, yielding, looking, critical;
    init outside;
    trans
        outside -> claiming {{ assign rung = 1; }},
        claiming -> yielding {{ assign level[pid] = rung; }},
        yielding -> looking {{ assign last[rung] = pid, other = 0; }},
        looking -> looking {{ guard other < N
            && (other == pid || level[other] < rung || last[rung] != pid);
            assign other = other + 1; }},
        looking -> looking {{ guard other < N
            && other != pid && level[other] >= rung && last[rung] == pid; assign other = 0; }},
        looking -> claiming {{ guard other == N && rung < N - 1;
            assign rung = rung + 1, other = 0; }},
        looking -> critical {{ guard other == N && rung == N - 1; assign other = 0; }},
        critical -> outside {{ assign level[pid] = 0, rung = 0; }};
}}
system P;
"""


def alarms(sensors: int) -> str:
    """Sensors that all wake at once and measure and report in urgent steps; one may meet smoke."""
    return f"""
const int N = {sensors};
broadcast chan wake;
int[0, N] smoke = N;
bool reported[N];

process Beat() {{
    clock t;
    state waiting {{ t <= 10 }}, working, looking {{ t <= 2 }};
    urgent working;
    init waiting;
    trans
        waiting -> working {{ select where : int[0, N]; guard t == 10; assign smoke = where; }},
        working -> looking {{ sync wake!; assign t = 0; }},
        looking -> waiting {{ guard t == 2; assign t = 0; }};
}}

process Sensor(const int[0, N - 1] me) {{
    int[0, 1] heat;
    state asleep, measuring, judging, reporting, storing;
    urgent measuring, judging, reporting, storing;
    init asleep;
    trans
        asleep -> measuring {{ sync wake?; }},
        measuring -> judging {{ assign heat = smoke == me; }},
        judging -> reporting {{ guard heat == 1; }},
        judging -> storing {{ guard heat == 0; }},
        reporting -> asleep {{ assign reported[me] = true; }},
        storing -> asleep {{ assign reported[me] = false, heat = 0; }};
}}
system Beat, Sensor;
"""


def samplers(controllers: int) -> str:
    """Controllers that read four inputs each, one after the other, and work out their next step."""
    return f"""
const int N = {controllers};

process Controller(const int[0, N - 1] me) {{
    clock x;
    bool warm, bright, loud, near;
    int[0, 3] level;
    int[0, 3] next() {{
        if (warm && bright || loud)
            return (level + 1) % 4;
        if (near && level > 0)
            return level - 1;
        return level;
    }}
    state working {{ x <= 3 + me }}, feeling, looking, hearing, ranging, deciding;
    commit feeling, looking, hearing, ranging, deciding;
    init working;
    trans
        working -> feeling {{ guard x >= 2 + me; }},
        feeling -> looking {{ select input : int[0, 1]; assign warm = input; }},
        looking -> hearing {{ select input : int[0, 1]; assign bright = input; }},
        hearing -> ranging {{ select input : int[0, 1]; assign loud = input; }},
        ranging -> deciding {{ select input : int[0, 1]; assign near = input; }},
        deciding -> working {{ assign level = next(), x = 0; }};
}}
system Controller;
"""


def entangled(processes: int) -> str:
    """Urgent processes of which each reads what all write: no order may be left out."""
    return f"""
const int N = {processes};
int[0, 3] total;
broadcast chan wake;

process Beat() {{
    clock t;
    state waiting {{ t <= 5 }};
    init waiting;
    trans waiting -> waiting {{ guard t == 5; sync wake!; assign t = 0; }};
}}

process P(const int[0, N - 1] me) {{
    int[0, 3] seen;
    state asleep, reading, writing;
    urgent reading, writing;
    init asleep;
    trans
        asleep -> reading {{ sync wake?; }},
        reading -> writing {{ assign seen = total; }},
        writing -> asleep {{ assign total = (seen + me) % 4; }};
}}
system Beat, P;
"""


def roll_call(sensors: int, window: int = 10, cycle: int = 1500) -> str:
    """Sensors that each call a centre in a window of their own, and all begin again at one time."""
    return f"""
const int N = {sensors};
const int WINDOW = {window};
const int CYCLE = {cycle};
chan alive, ack;

process Sensor(const int[0, N - 1] id) {{
    clock x;
    state before {{ x <= WINDOW * id + 1 }}, calling {{ x <= WINDOW * id + 6 }},
        listening {{ x <= WINDOW * id + WINDOW - 1 }}, resting {{ x <= CYCLE }};
    init before;
    trans
        before -> calling {{ guard x >= WINDOW * id + 1; }},
        calling -> listening {{ sync alive!; }},
        listening -> resting {{ sync ack?; }},
        listening -> resting {{ guard x >= WINDOW * id + WINDOW - 1; }},
        resting -> before {{ guard x >= CYCLE; assign x = 0; }};
}}

process Centre() {{
    state on;
    init on;
    trans
        on -> on {{ sync alive?; }},
        on -> on {{ sync ack!; }};
}}
system Sensor, Centre;
"""


def beacons(processes: int) -> str:
    """Processes that broadcast to all others, each of whom listens while its clock allows."""
    return f"""
const int N = {processes};
broadcast chan flash;
process Beacon(const int[1, N] pid) {{
    clock x;
    state dark {{ x <= 10 + pid }}, lit {{ x <= 3 }};
    init dark;
    trans
        dark -> lit {{ guard x >= 8; sync flash!; assign x = 0; }},
        dark -> dark {{ guard x >= 4; sync flash?; assign x = 6; }},
        lit -> dark {{ guard x >= 1; assign x = 0; }};
}}
system Beacon;
"""


def couriers(people: int) -> str:
    """People who hand a parcel on to whom they like, by channels of pairs that they compute."""
    return f"""
const int N = {people};
const int M = 4;
chan hand[N * N];
int[0, M] parcels[N];
int[0, 3] mood[N];
process Person(const int[0, N - 1] pid) {{
    state here;
    init here;
    trans
        here -> here {{ select to : int[0, N - 1];
            guard to != pid && parcels[pid] > 0 && mood[to] != 3;
            sync hand[pid * N + to]!; assign parcels[pid] = parcels[pid] - 1; }},
        here -> here {{ select by : int[0, N - 1]; guard parcels[pid] < M;
            sync hand[by * N + pid]?; assign parcels[pid] = parcels[pid] + 1; }},
        here -> here {{ select m : int[0, 3]; guard m == (mood[pid] + 1) % 4;
            assign mood[pid] = m; }},
        here -> here {{ guard pid == 0 && parcels[0] == 0; assign parcels[0] = 2; }};
}}
system Person;
"""


def lamps(count: int) -> str:
    """Lamps with a flag of their own that says whether their clock still matters."""
    return f"""
const int N = {count};
process Lamp(const int[1, N] pid) {{
    clock x;
    bool running;
    state one {{ !running || x <= 20 + pid }};
    init one;
    trans
        one -> one {{ guard !running; assign running = true, x = 0; }},
        one -> one {{ guard running && x >= 10 + pid; assign running = false; }};
}}
system Lamp;
"""


def relays(count: int) -> str:
    """Pairs of which the one that is woken needs a clock that the one that wakes it sets."""
    return f"""
const int N = {count};
chan wake[N], done[N];
clock x[N];
process Caller(const int[0, N - 1] pid) {{
    clock y;
    state calm {{ y <= 9 + pid }}, calling;
    init calm;
    trans
        calm -> calling {{ guard y >= 4; sync wake[pid]!; assign x[pid] = 0; }},
        calling -> calm {{ sync done[pid]?; assign y = 0; }};
}}
process Sleeper(const int[0, N - 1] pid) {{
    state asleep, awake {{ x[pid] <= 5 }};
    init asleep;
    trans
        asleep -> awake {{ sync wake[pid]?; }},
        awake -> asleep {{ guard x[pid] >= 2; sync done[pid]!; }};
}}
system Caller, Sleeper;
"""


def sorters(count: int, length: int = 8) -> str:
    """Processes that reverse parts of an array, which is judged by loops in functions."""
    order = ", ".join(str((5 * index + 3) % length) for index in range(length))
    return f"""
const int N = {length};
int[0, N - 1] row[N] = {{ {order} }};
void turn(int[0, N - 1] from, int[0, N - 1] to) {{
    int kept[N];
    for (i : int[0, N - 1]) kept[i] = row[i];
    for (i : int[0, N - 1]) if (i >= from && i <= to) row[i] = kept[from + to - i];
}}
int inversions() {{
    int found = 0;
    for (i : int[0, N - 1]) for (j : int[0, N - 1])
        if (i < j && row[i] > row[j]) found = found + 1;
    return found;
}}
process Sorter(const int[1, {count}] pid) {{
    state here;
    init here;
    trans here -> here {{ select i : int[0, N - 2], j : int[1, N - 1];
        guard i < j && (i + j + pid) % 2 == 0 && inversions() > j - i; assign turn(i, j); }};
}}
system Sorter;
"""


def switchboard(lines: int, callers: int) -> str:
    """Callers who ring numbers of an operator, whose lines are plugged into other numbers."""
    return f"""
const int N = {lines};
chan ring[N];
int[0, N - 1] plugged[N];
process Caller(const int[0, {callers} - 1] pid) {{
    clock x;
    int[0, N - 1] number;
    state calm {{ x <= 5 }};
    init calm;
    trans calm -> calm {{ guard x >= 2; sync ring[number]!;
        assign x = 0, number = (number + pid + 1) % N; }};
}}
process Operator() {{
    state here;
    init here;
    trans here -> here {{ select line : int[0, N - 1]; sync ring[plugged[line]]?;
        assign plugged[line] = (plugged[line] + line) % N; }};
}}
system Caller, Operator;
"""


def rumours(people: int) -> str:
    """People who tell each other all that they know, on channels of pairs of what two know."""
    return f"""
const int N = {people};
const int ALL = (1 << N) - 1;
typedef int[0, ALL] known_t;
chan tell[ALL + 1][ALL + 1];
process Person(const int[0, N - 1] pid) {{
    clock x;
    known_t known = 1 << pid;
    int[0, N + 1] lasts;
    int[0, N + 1] length(known_t own, known_t other) {{
        int[0, N + 1] count = 1;
        for (i : int[0, N - 1]) count += ((own ^ other) >> i) & 1;
        return count;
    }}
    state free, talking {{ x <= lasts }};
    init free;
    trans
        free -> talking {{ select other : known_t; sync tell[known][other]!;
            assign lasts = length(known, other), known = known | other, x = 0; }},
        free -> talking {{ select other : known_t; sync tell[other][known]?;
            assign lasts = length(known, other), known = known | other, x = 0; }},
        talking -> free {{ guard x >= lasts; assign lasts = 0; }};
}}
system Person;
"""


def resets(clocks: int, latest: int) -> str:
    """Clocks that are set back from time to time: all zones belong to one discrete state."""
    return f"""
process Timer(const int[0, {clocks} - 1] pid) {{
    clock x;
    state runs {{ x <= {latest} + pid }};
    init runs;
    trans runs -> runs {{ guard x >= 1 + pid % 3; assign x = 0; }};
}}
system Timer;
"""


def menu(dishes: int) -> str:
    """Cooks with functions of their own, most of which hardly run before the first dish is done."""
    cooks = "".join(
        f"""
process Cook{cook}() {{
    clock x;
    int[0, 100] used;
    bool may() {{
        int total = {cook};
        for (k : int[0, 4]) total = (total * 7 + k + shared) % 97;
        return total != {cook % 90};
    }}
    void take() {{ used = (used * 3 + {cook}) % 101; shared = (shared + used) % 50; }}
    state idle, cooks, done;
    init idle;
    trans idle -> cooks {{ guard x >= {cook % 7} && may(); assign take(), x = 0; }},
        cooks -> done {{ guard may() && turn == {cook}; assign turn = {cook + 1}, take(); }};
}}"""
        for cook in range(dishes)
    )
    names = ", ".join(f"Cook{cook}" for cook in range(dishes))
    return f"int[0, {dishes}] turn;\nint[0, 50] shared;{cooks}\nsystem {names};\n"


def store() -> str:
    """Every round the controller gives and the environment takes, both up to four."""
    return """
int[-9, 99] stock = 20;
int[0, 4] given;
clock x;
process Store() {
    state Give, Take { x <= 1 }, Wait { x <= 1 };
    commit Give;
    init Give;
    trans Give -> Take { select g : int[0, 4]; assign given = g; },
        Take -u-> Wait { guard x >= 1 && stock < 95 && stock > -5; select t : int[0, 4];
            assign stock += given - t, given = 0; },
        Wait -u-> Give { guard x >= 1; assign x = 0; };
}
system Store;
"""


def duel() -> str:
    """Two who need a while between two blows; all moves are the environment's."""
    return """
int[0, 9] life[2] = {6, 6};
int[0, 3] tricks[2] = {2, 2};
chan hit[2], stun[2];
process Fighter(const int[0, 1] pid) {
    clock blow, trick, pause, rest;
    state Ready { pause <= 4 }, Stunned { rest <= 2 }, Struck;
    commit Struck;
    init Ready;
    trans Ready -u-> Ready { guard blow > 2; sync hit[1 - pid]!; assign blow = 0, pause = 0; },
        Ready -u-> Ready { guard trick > 3 && tricks[pid] > 0; sync stun[1 - pid]!;
            assign tricks[pid]--, trick = 0, pause = 0; },
        Ready -u-> Struck { sync hit[pid]?; assign life[pid]--; },
        Ready -u-> Stunned { sync stun[pid]?; assign rest = 0; },
        Stunned -u-> Struck { sync hit[pid]?; assign life[pid]--; },
        Stunned -u-> Ready { guard rest >= 2; assign pause = 0; },
        Struck -u-> Ready { guard life[pid] > 0; assign pause = 0; };
}
system Fighter;
"""


def ring(players: int, latest: int) -> str:
    """Players whose clocks are compared with their neighbours', and never grow large."""
    return f"""
const int N = {players};
clock x[N];
int[0, 9] hits;
process Player(const int[0, N - 1] pid) {{
    state aims {{ x[pid] <= {latest} }}, struck {{ x[pid] <= {latest} }};
    init aims;
    trans aims -> struck {{ guard x[pid] >= 1 && x[pid] - x[(pid + 1) % N] >= 1;
            assign hits = hits < 9 ? hits + 1 : 9; }},
        aims -u-> aims {{ guard x[pid] >= {latest}; assign x[pid] = 0; }},
        aims -u-> struck {{ guard x[pid] >= 2 && x[(pid + 1) % N] - x[pid] <= 2
            && x[pid] - x[(pid + 2) % N] <= {latest - 1}; }},
        struck -u-> aims {{ guard x[pid] - x[(pid + 1) % N] <= 2; assign x[pid] = 0; }},
        struck -> aims {{ guard x[pid] >= {latest}; assign x[pid] = 0, hits = 0; }};
}}
system Player;
"""


def ferries(count: int) -> str:
    """Ferries that share a quay for one, with chance: who finds it taken waits at anchor."""
    return f"""
const int N = {count};
typedef int[0, N - 1] id_t;
broadcast chan moored[N], cast_off[N];
urgent broadcast chan enter[N];
bool is_taken = false;
int[0, N] waiting = 0;
bool anchors[N];
id_t first() {{
    for (i : id_t) if (anchors[i]) return i;
    return 0;
}}
process Ferry(const id_t id) {{
    clock x;
    state sea {{ ; (1 + id):50 }}, anchor, entering {{ x <= 4 }}, quay {{ x <= 9 }};
    init sea;
    trans sea -> entering {{ guard !is_taken; assign is_taken = true, x = 0; }},
          sea -> anchor {{ guard is_taken; assign anchors[id] = true, waiting = waiting + 1; }},
          anchor -> entering {{ sync enter[id]?; assign x = 0; }},
          entering -> quay {{ guard x >= 1; sync moored[id]!; assign x = 0; }},
          quay -> sea {{ guard x >= 3; sync cast_off[id]!; assign is_taken = false; }};
}}
process Harbour() {{
    state watch;
    init watch;
    trans watch -> watch {{ guard !is_taken && waiting > 0; sync enter[first()]!;
        assign is_taken = true, anchors[first()] = false, waiting = waiting - 1; }};
}}
system Ferry, Harbour;
"""


def till(customers: int) -> str:
    """A queue before a till, with chance."""
    return f"""
broadcast chan come, leave;
int[0, {customers}] length = 0;
process Door() {{
    state open {{ ; 9:10 }};
    init open;
    trans open -> open {{ sync come!; }};
}}
process Till() {{
    state free, busy {{ ; 1 }};
    init free;
    trans free -> busy {{ sync come?; assign length = 1; }},
          busy -> busy {{ guard length < {customers}; sync come?; assign length = length + 1; }},
          busy -> busy {{ guard length > 1; sync leave!; assign length = length - 1; }},
          busy -> free {{ guard length == 1; sync leave!; assign length = 0; }};
}}
system Door, Till;
"""
