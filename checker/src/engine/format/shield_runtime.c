
uint64_t NAME_allowed(const double values[], uint64_t enabled)
{
    size_t first = 0, end = NAME_RUNS - 1, axis;
    uint64_t cell = 0, allowed;
    if (!(enabled & (enabled - 1)))
        return enabled;
    for (axis = 0; axis < NAME_AXES; axis++) {
        double place = (values[axis] - NAME_lows[axis]) / NAME_widths[axis];
        if (!(place >= 0 && place < NAME_counts[axis]))
            return enabled;
        cell = cell * (uint64_t)NAME_counts[axis] + (uint64_t)place;
    }
    while (first < end) {
        size_t middle = first + (end - first) / 2;
        if (NAME_ends[middle] <= cell)
            first = middle + 1;
        else
            end = middle;
    }
    allowed = enabled & NAME_sets[first];
    return allowed ? allowed : enabled;
}
