
static int controller_sees(int state, const unsigned char *seen)
{
    int i;
    for (i = 0; i < CONTROLLER_OBSERVATIONS; i++)
        if (controller_seen[(size_t)state * CONTROLLER_OBSERVATIONS + (size_t)i] != (seen[i] != 0))
            return 0;
    return 1;
}

int controller_propose(int state)
{
    if (state < 0 || state >= CONTROLLER_STATES)
        return CONTROLLER_NONE;
    return controller_actions[state];
}

int controller_next(int state, const unsigned char *seen)
{
    size_t i;
    if (state < 0 || state >= CONTROLLER_STATES)
        return CONTROLLER_NONE;
    if (controller_sees(state, seen))
        return state;
    for (i = controller_starts[state]; i < controller_starts[state + 1]; i++)
        if (controller_sees((int)controller_targets[i], seen))
            return (int)controller_targets[i];
    return CONTROLLER_NONE;
}
