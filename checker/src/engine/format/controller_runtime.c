/* Whether the constraint holds of these clock values. */
static int controller_holds(size_t constraint, const controller_time *clocks)
{
    size_t left = controller_left[constraint], right = controller_right[constraint];
    controller_time difference = (left ? clocks[left - 1] : 0) - (right ? clocks[right - 1] : 0);
    controller_time bound = (controller_time)controller_bounds[constraint] * CONTROLLER_UNIT;
    return difference < bound || (difference == bound && !controller_strict[constraint]);
}

static int controller_zone_holds(size_t zone, const controller_time *clocks)
{
    size_t i = controller_zones[zone];
    while (i < controller_zones[zone + 1] && controller_holds(controller_constraints[i], clocks))
        i++;
    return i == controller_zones[zone + 1];
}

/* The row of the rules for a discrete state, or -1 if nothing is known about it. */
static long controller_row(const int32_t *state)
{
    controller_key key[CONTROLLER_KEYS] = {0};
    size_t bit = 0, first = 0, last = CONTROLLER_STATES;
    size_t i;
    for (i = 0; i < CONTROLLER_STATE_WORDS; i++) {
        uint32_t value = (uint32_t)state[i] - (uint32_t)controller_lows[i];
        unsigned width = controller_widths[i], done = 0;
        if (value > controller_ranges[i])
            return -1;
        while (done < width) {
            if ((value >> done) & 1u)
                key[bit / CONTROLLER_KEY_BITS] |= (controller_key)(1u << (bit % CONTROLLER_KEY_BITS));
            done++;
            bit++;
        }
    }
    while (first < last) {
        size_t middle = first + (last - first) / 2;
        const controller_key *other = controller_keys[middle];
        for (i = 0; i + 1 < CONTROLLER_KEYS && key[i] == other[i]; i++) {
        }
        if (key[i] == other[i])
            return (long)controller_rows[middle];
        if (key[i] < other[i])
            last = middle;
        else
            first = middle + 1;
    }
    return -1;
}

/* Makes the time longer that the clocks stay in zones in which the strategy waits, by one zone if there is one. */
static int controller_wait_on(size_t zone, const controller_time *clocks, controller_decision *wait)
{
    controller_time from = 0, to = -1;
    int from_is_open = 0, to_is_open = 0;
    size_t i;
    for (i = controller_zones[zone]; i < controller_zones[zone + 1]; i++) {
        size_t one = controller_constraints[i];
        size_t left = controller_left[one], right = controller_right[one];
        controller_time bound = (controller_time)controller_bounds[one] * CONTROLLER_UNIT;
        int strict = controller_strict[one];
        if (left && right) {
            if (!controller_holds(one, clocks))
                return 0;
        } else if (left) {
            controller_time end = bound - clocks[left - 1];
            if (end < 0)
                return 0;
            if (to < 0 || end < to || (end == to && strict)) {
                to = end;
                to_is_open = strict;
            }
        } else {
            controller_time start = -bound - clocks[right - 1];
            if (start > from || (start == from && strict)) {
                from = start;
                from_is_open = strict;
            }
        }
    }
    if (to >= 0 && (from > to || (from == to && (from_is_open || to_is_open))))
        return 0;
    if (from > wait->wait || (from == wait->wait && from_is_open && wait->is_open))
        return 0;
    if (to >= 0 && (to < wait->wait || (to == wait->wait && (to_is_open || !wait->is_open))))
        return 0;
    wait->wait = to;
    wait->is_open = to_is_open;
    return 1;
}

controller_decision controller_decide(const int32_t *state, const controller_time *clocks)
{
    controller_decision decision = {CONTROLLER_NONE, 0, 0};
    long row = controller_row(state);
    size_t rule, first, last;
    if (row < 0)
        return decision;
    if (row == CONTROLLER_GOAL_ROW) {
        decision.action = CONTROLLER_OVER;
        return decision;
    }
    first = controller_row_starts[row];
#if CONTROLLER_HAS_LEGS
    last = first + controller_row_owns[row];
#else
    last = controller_row_starts[row + 1];
#endif
    for (rule = first; rule < last; rule++) {
        if (controller_zone_holds(controller_rule_zones[rule], clocks)) {
            decision.action = (int)controller_rule_actions[rule] - 1;
            break;
        }
    }
    if (decision.action == CONTROLLER_WAIT) {
        for (rule = first; rule < last && decision.wait >= 0; rule++) {
            /* Once longer, zones before this one may go on. */
            if (controller_rule_actions[rule] == 0
                && controller_wait_on(controller_rule_zones[rule], clocks, &decision))
                rule = first - 1;
        }
    }
    return decision;
}

int controller_allows(const int32_t *state, const controller_time *clocks, int action)
{
#if CONTROLLER_IS_PERMISSIVE
    long row = controller_row(state);
    size_t rule;
    if (row < 0 || row == CONTROLLER_GOAL_ROW)
        return 0;
    for (rule = controller_row_starts[row]; rule < controller_row_starts[row + 1]; rule++) {
        if ((int)controller_rule_actions[rule] - 1 == action
            && controller_zone_holds(controller_rule_zones[rule], clocks))
            return 1;
    }
    return 0;
#else
#if CONTROLLER_HAS_LEGS
    long row = controller_row(state);
    if (row > CONTROLLER_GOAL_ROW) {
        size_t rule = controller_row_starts[row] + controller_row_owns[row];
        for (; rule < controller_row_starts[row + 1]; rule++) {
            if ((int)controller_rule_actions[rule] - 1 == action
                && controller_zone_holds(controller_rule_zones[rule], clocks))
                return 1;
        }
    }
#endif
    return controller_decide(state, clocks).action == action;
#endif
}
