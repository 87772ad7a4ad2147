
static double NAME_worth(size_t node, const double continuous[])
{
    while (NAME_highs[node])
        node = continuous[NAME_features[node]] <= NAME_numbers[node] ? node + 1 : NAME_highs[node];
    return NAME_numbers[node];
}

int NAME_decide(const double discrete[], const double continuous[], const unsigned char enabled[])
{
    size_t first = 0, end = NAME_KEYS, i;
    int best = -1;
    double least = 0;
    while (first < end) {
        size_t middle = first + (end - first) / 2;
        const double *key = NAME_keys + middle * NAME_DISCRETE;
        int place = 0;
        while (place < NAME_DISCRETE && key[place] == discrete[place])
            place++;
        if (place == NAME_DISCRETE)
            break;
        if (key[place] < discrete[place])
            first = middle + 1;
        else
            end = middle;
    }
    if (first >= end)
        return -1;
    first += (end - first) / 2;
    for (i = NAME_starts[first]; i < NAME_starts[first + 1]; i++)
        if (enabled[NAME_actions[i]]) {
            double cost = NAME_SIGN * NAME_worth(NAME_roots[i], continuous);
            if (best < 0 || cost < least) {
                best = (int)NAME_actions[i];
                least = cost;
            }
        }
    return best;
}
