"""The templates as Python. `make templates` wrote this; do not change it."""

# ruff: noqa
# mypy: ignore-errors

from typing import Any

from ntagen.render.writing import Safe, escaped, shown, with_last


def declaration(model: Any, source: Any) -> str:
    out = []
    put = out.append
    def rows(values):
        out = []
        put = out.append
        put('{')
        for is_last_1, value in with_last(values):
            put('\n'
                '    ')
            put(shown(value.text))
            put(shown((',' if (not is_last_1) else '')))
            put(shown((''.join(map(shown, ('  // ', value.note,))) if value.note else '')))
        put('\n'
            '}')
        return Safe("".join(out))
    put('// ')
    put(shown(model.name))
    put(': steering a bevel-tip needle through tissue, as a timed game.')
    if source:
        put('\n'
            '// Made from ')
        put(shown(source))
        put('; change that file, not this one.')
    put('\n'
        '//\n'
        '// Numbers. UPPAAL keeps integers in its states, so every length, direction and angle is stored as an integer number of\n'
        "// units, _SI_ units being 1 mm, 1 (of a direction's component) or 1 rad. A computation divides by _SI_, works in doubles,\n"
        '// multiplies by _SI_ and cuts the fraction off (fint rounds towards zero).\n'
        '//\n'
        '// Axes. Insertion runs along -y.')
    if model.frame_note:
        put(' ')
        put(shown(model.frame_note))
    put(' The tip has a frame of its own: its x-axis is the\n'
        '// direction of travel, its z-axis points away from the centre of the motion circle, and the needle bends about the\n'
        '// y-axis, which is z cross x.\n'
        '//\n'
        '// Time. One unit of the clocks is ')
    put(shown(model.time_unit))
    put('.\n'
        '\n')
    put(shown(('%-53s' % ('typedef int[-2147483648, 2147483647] fixed_t;',))))
    put(' // A fixed-point number: 32 bits, in units of 1/_SI_.\n'
        '\n')
    put(shown(('%-53s' % (''.join(map(shown, ('const int _SI_ = ', model.scale, ';',))),))))
    put(' // Units in one millimetre (or in 1, or in 1 rad).\n'
        'const double PI = 3.14159265358979312;\n'
        '\n')
    put(shown(('%-53s' % (''.join(map(shown, ('const int dt = ', model.dt, ';',))),))))
    put(' // Duration of one push, in units of ')
    put(shown(('needle_vel' if model.moving else 'time')))
    put('.\n'
        '\n'
        '/********************************************** What the user may do **********************************************/\n'
        '\n'
        '/** Actions **/\n')
    put(shown(('%-53s' % (''.join(map(shown, ('const fixed_t MIN_PROG_BETWEEN_ROTS = ', model.min_progress, ';',))),))))
    put(' // Insertion between two rolls, at least.\n')
    put(shown(('%-53s' % (''.join(map(shown, ('const fixed_t MAX_PROG = ', model.max_progress, ';',))),))))
    put(' // Insertion from here, at most: what is left of the needle.\n')
    put(shown(('%-53s' % (''.join(map(shown, ('const int MAX_ROT_COUNT = ', model.max_rolls, ';',))),))))
    put(' // Rolls on one path, at most.\n'
        '\n'
        'const int PUSH_ACTION = 0;                            // The two types of action in the log.\n'
        'const int ROLL_ROTATE_ACTION = 1;\n'
        '\n')
    put(shown(('%-53s' % (''.join(map(shown, ('const int MAX_ACT_COUNT = ', model.max_actions, ';',))),))))
    put(' // Entries of the log: each roll makes two.\n'
        'const int ACT_PROG = 0;                               // Columns of an entry: needle progress at the start of the action,\n'
        'const int ACT_TYPE = 1;                               //   its type,\n'
        'const int ACT_VAL = 2;                                //   its value: millimetres pushed (in units) or degrees rolled.\n'
        'fixed_t actions[MAX_ACT_COUNT][3];                    // The log of the path so far.\n'
        'fixed_t curr_ACT_index = 0;                           // The entry that is written next.\n'
        '\n'
        'int ROT_counter = 0;                                  // Rolls on the path so far.\n'
        'int prev_ROT_index = -1;                              // Entry of the last roll; -1 before the first.\n'
        '\n'
        'const int ANGLE_COUNT = ')
    put(shown(len(model.angles)))
    put(';\n'
        'const int allowed_rot_angles[ANGLE_COUNT] = {         // The rolls to choose from, in degrees.')
    if model.spins:
        put(' A roll by 0 changes the spin alone.')
    put('\n'
        '    ')
    put(shown(', '.join(map(shown, model.angles))))
    put('\n'
        '};\n'
        'int sel_rot_angle = 0;                                // The roll chosen last.\n'
        '\n'
        '/**************************************************** The regions ****************************************************/')
    if model.solids.tables:
        put('\n'
            '// The spheres: a centre and a radius each. Other shapes have tables further below, and are not counted here.')
    else:
        put('\n'
            '// All are spheres: a centre and a radius each. They stay where they are, so they are constants and no part of the state.')
    put('\n'
        '// UPPAAL has no empty arrays: a kind without regions has one row of zeros, which the count and the flag leave unread.\n'
        '\n'
        '/** Detection regions (DR): shells in which the force tells that a critical region is near **/\n'
        'const int DR_COUNT = ')
    put(shown(model.detections.count))
    put(';\n'
        'const bool HAS_DETECTION_REGIONS = ')
    put(shown(('true' if model.detections.count else 'false')))
    put(';\n'
        'const bool TREAT_DR_AS_CR = true;                     // A path through a detection region is given up as well.\n'
        'const fixed_t DR_center[')
    put(shown(('DR_COUNT' if model.detections.count else 1)))
    put('][3] = ')
    put(shown(rows(model.detections.centers)))
    put(';\n'
        'const fixed_t DR_radius[')
    put(shown(('DR_COUNT' if model.detections.count else 1)))
    put('] = ')
    put(shown(rows(model.detections.radii)))
    put(';\n'
        '\n'
        '/** Critical regions (CR): never to be touched **/\n'
        'const int CR_COUNT = ')
    put(shown(model.criticals.count))
    put(';\n'
        'const bool HAS_CRITICAL_REGIONS = ')
    put(shown(('true' if model.criticals.count else 'false')))
    put(';\n'
        'const fixed_t CR_center[')
    put(shown(('CR_COUNT' if model.criticals.count else 1)))
    put('][3] = ')
    put(shown(rows(model.criticals.centers)))
    put(';\n'
        'const fixed_t CR_radius[')
    put(shown(('CR_COUNT' if model.criticals.count else 1)))
    put('] = ')
    put(shown(rows(model.criticals.radii)))
    put(';')
    if model.unexplored.count:
        put('\n'
            '\n'
            '/** Unexplored regions (UR): nobody knows what is there, so they are not to be touched either **/\n'
            'const int UR_COUNT = ')
        put(shown(model.unexplored.count))
        put(';\n'
            'const fixed_t UR_center[UR_COUNT][3] = ')
        put(shown(rows(model.unexplored.centers)))
        put(';\n'
            'const fixed_t UR_radius[UR_COUNT] = ')
        put(shown(rows(model.unexplored.radii)))
        put(';')
    if model.safe.count:
        put('\n'
            '\n'
            '/** Safe regions (SR): nothing critical is there. The model does not ask about them; the driver learns nothing in them **/\n'
            'const int SR_COUNT = ')
        put(shown(model.safe.count))
        put(';\n'
            'const fixed_t SR_center[SR_COUNT][3] = ')
        put(shown(rows(model.safe.centers)))
        put(';\n'
            'const fixed_t SR_radius[SR_COUNT] = ')
        put(shown(rows(model.safe.radii)))
        put(';')
    put('\n'
        '\n'
        '/** Target regions (TR): to be reached one after the other **/\n'
        'const int TR_COUNT = ')
    put(shown(model.targets.count))
    put(';\n'
        'const fixed_t TR_center[TR_COUNT][3] = ')
    put(shown(rows(model.targets.centers)))
    put(';\n'
        'const fixed_t TR_radius[TR_COUNT] = ')
    put(shown(rows(model.targets.radii)))
    put(';\n'
        'fixed_t curr_TR_index = 0;                            // The target that is sought: so many were reached before it.\n'
        '\n'
        '/***************************************************** The needle *****************************************************/\n'
        '\n'
        'fixed_t needle_progress = 0;                          // Needle inserted so far.\n')
    put(shown(('%-53s' % (''.join(map(shown, ('fixed_t tip_pos[3] = ', model.tip_position, ';',))),))))
    put(' // Where the tip is.\n')
    put(shown(('%-53s' % (''.join(map(shown, ('const fixed_t needle_vel = ', model.velocity, ';',))),))))
    put(' // Insertion per unit of time.\n'
        'fixed_t tip_roll = 0;                                 // The roll made last.\n'
        '\n'
        '/** The motion circle: on it the tip travels until the next roll **/\n'
        'fixed_t motion_circle_center[3] = {0, 0, 0};')
    if model.adversary:
        put('\n'
            'fixed_t motion_circle_r = ')
        put(shown(model.circle_radius))
        put(';   // The tissue decides it for each segment; see below.')
    elif model.spins:
        put('\n')
        put(shown(('%-53s' % (''.join(map(shown, ('fixed_t motion_circle_r = ', model.circle_radius, ';',))),))))
        put(' // It depends on the spin; see below.')
    else:
        put('\n'
            'const fixed_t motion_circle_r = ')
        put(shown(model.circle_radius))
        put(';')
    if (model.swept or model.only_plans):
        put('\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const fixed_t CIRCLE_MARGIN = ', model.sweep_margin, ';',))),))))
        put(' // How far the tip may be off the circle by rounding.')
    put('\n'
        'fixed_t motion_circle_yaw = 0;                        // Angle travelled on the circle since the last roll.\n'
        '\n'
        '/** Vectors, named by their index **/\n'
        'const int GLOBAL_X_VEC = 0;                           // The axes of the world.\n'
        'const int GLOBAL_Y_VEC = 1;\n'
        'const int GLOBAL_Z_VEC = 2;\n'
        'const int TIP_X_VEC = 3;                              // The axes of the tip, in the world: direction of travel,\n'
        'const int TIP_Y_VEC = 4;                              //   axis of the bend,\n'
        'const int TIP_Z_VEC = 5;                              //   away from the centre of the motion circle.\n'
        'const int TEMP_VEC_1 = 6;                             // Intermediate results.\n'
        'const int TEMP_VEC_2 = 7;\n'
        '\n'
        'const int VECTOR_COUNT = 8;\n'
        'fixed_t vectors[VECTOR_COUNT][3] = {\n'
        '    {1*_SI_, 0, 0},\n'
        '    {0, 1*_SI_, 0},\n'
        '    {0, 0, 1*_SI_},\n'
        '    {0, 0, 0},\n'
        '    {0, 0, 0},\n'
        '    {0, 0, 0},\n'
        '    {0, 0, 0},\n'
        '    {0, 0, 0}\n'
        '};\n'
        '\n'
        '/** Matrices, named by their index; columns are the images of the axes **/\n'
        'const int ID_MAT = 0;\n'
        "const int TIP_BASE_ROT_MAT = 1;                       // The tip's frame after the last roll (or at the start).\n"
        'const int TIP_CIRCLE_ROT_MAT = 2;                     // What the travel on the circle has added since.\n'
        'const int TIP_ACTION_ROT_MAT = 3;                     // What the roll of the moment adds.\n'
        "const int TIP_ROT_MAT = 4;                            // All of them together: the tip's frame now.\n"
        'const int TEMP_MAT_1 = 5;                             // Intermediate results.\n'
        '\n'
        'const int MATRIX_COUNT = 6;\n'
        'fixed_t matrices[MATRIX_COUNT][3][3] = {\n'
        '    ')
    put(shown('{{1*_SI_, 0, 0}, {0, 1*_SI_, 0}, {0, 0, 1*_SI_}}'))
    put(',\n'
        '    ')
    put(shown(model.base_matrix))
    put(',\n'
        '    ')
    put(shown('{{1*_SI_, 0, 0}, {0, 1*_SI_, 0}, {0, 0, 1*_SI_}}'))
    put(',\n'
        '    ')
    put(shown('{{1*_SI_, 0, 0}, {0, 1*_SI_, 0}, {0, 0, 1*_SI_}}'))
    put(',\n'
        '    ')
    put(shown('{{1*_SI_, 0, 0}, {0, 1*_SI_, 0}, {0, 0, 1*_SI_}}'))
    put(',\n'
        '    ')
    put(shown('{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}'))
    put('\n'
        '};\n'
        '\n')
    put('/********************************************* Vectors and matrices *********************************************/\n'
        '\n'
        '// out_mat = in_mat_1 * in_mat_2. Each product is cut to units before the sum, as in the paper.\n'
        'void matrix_matrix_dot(int in_mat_1, int in_mat_2, int out_mat) {\n'
        '    int i,j,k;\n'
        '    fixed_t entry_sum;\n'
        '    double _S_ = _SI_*1.0;\n'
        '\n'
        '    for (i=0; i<3; i++) {\n'
        '        for (j=0; j<3; j++) {\n'
        '            entry_sum = 0;\n'
        '            for (k=0; k<3; k++) {\n'
        '                entry_sum += fint(((matrices[in_mat_1][i][k]/_S_) * (matrices[in_mat_2][k][j]/_S_))*_S_);\n'
        '            }\n'
        '            matrices[out_mat][i][j] = entry_sum;\n'
        '        }\n'
        '    }\n'
        '}\n'
        '\n'
        '// out_vec = in_mat * in_vec.\n'
        'void matrix_vector_dot(int in_mat, int in_vec, int out_vec) {\n'
        '    int i,k;\n'
        '    fixed_t entry_sum;\n'
        '    double _S_ = _SI_*1.0;\n'
        '\n'
        '    for (i=0; i<3; i++) {\n'
        '        entry_sum = 0;\n'
        '        for (k=0; k<3; k++) {\n'
        '            entry_sum += fint(((matrices[in_mat][i][k]/_S_) * (vectors[in_vec][k]/_S_))*_S_);\n'
        '        }\n'
        '        vectors[out_vec][i] = entry_sum;\n'
        '    }\n'
        '}\n'
        '\n'
        '// out_mat = in_mat.\n'
        'void copy_matrix(int in_mat, int out_mat) {\n'
        '    int i,j;\n'
        '    for (i=0; i<3; i++) {\n'
        '        for (j=0; j<3; j++) {\n'
        '            matrices[out_mat][i][j] = matrices[in_mat][i][j];\n'
        '        }\n'
        '    }\n'
        '}\n'
        '\n'
        '// The square of a number. The function pow gives the same but for the last bit, and takes ten times as long.\n'
        'double squared(double x) {\n'
        '    return x * x;\n'
        '}\n'
        '\n'
        '// The length of a vector.\n'
        'fixed_t get_magnitude(int in_vec) {\n'
        '    double _S_ = _SI_*1.0;\n'
        '\n'
        '    fixed_t res = fint((sqrt(squared(vectors[in_vec][0]/_S_) +\n'
        '                             squared(vectors[in_vec][1]/_S_) +\n'
        '                             squared(vectors[in_vec][2]/_S_)))*_S_);\n'
        '    return res;\n'
        '}\n'
        '\n'
        '// Brings a vector to length 1; the zero vector stays as it is.\n'
        'void normalize_vector(int in_vec) {\n'
        '    int i;\n'
        '    double _S_ = _SI_*1.0;\n'
        '\n'
        '    fixed_t magnitude = get_magnitude(in_vec);\n'
        '    if (magnitude == 0) {\n'
        '        return;\n'
        '    }\n'
        '    for (i=0; i<3; i++) {\n'
        '        vectors[in_vec][i] = fint(((vectors[in_vec][i]/_S_) / (magnitude/_S_)) * _S_);\n'
        '    }\n'
        '}\n'
        '\n'
        '// out_mat = rotation by theta about a unit vector (formula of Rodrigues; right-handed).\n'
        'void generate_rotation_matrix_from_axis_and_angle(int axis, fixed_t theta, int out_mat) {\n'
        '    double _S_ = _SI_*1.0;\n'
        '\n'
        '    matrices[out_mat][0][0] = fint((cos(theta/_S_) + squared(vectors[axis][0]/_S_) * (1 - cos(theta/_S_)))*_S_);\n'
        '    matrices[out_mat][0][1] = fint(((vectors[axis][0]/_S_) * (vectors[axis][1]/_S_) *\n'
        '                                (1 - cos(theta/_S_)) - (vectors[axis][2]/_S_) * sin(theta/_S_))*_S_);\n'
        '    matrices[out_mat][0][2] = fint(((vectors[axis][0]/_S_) * (vectors[axis][2]/_S_) *\n'
        '                                (1 - cos(theta/_S_)) + (vectors[axis][1]/_S_) * sin(theta/_S_))*_S_);\n'
        '    matrices[out_mat][1][0] = fint(((vectors[axis][1]/_S_) * (vectors[axis][0]/_S_) *\n'
        '                                (1 - cos(theta/_S_)) + (vectors[axis][2]/_S_) * sin(theta/_S_))*_S_);\n'
        '    matrices[out_mat][1][1] = fint((cos(theta/_S_) + squared(vectors[axis][1]/_S_) * (1 - cos(theta/_S_)))*_S_);\n'
        '    matrices[out_mat][1][2] = fint(((vectors[axis][1]/_S_) * (vectors[axis][2]/_S_) *\n'
        '                                (1 - cos(theta/_S_)) - (vectors[axis][0]/_S_) * sin(theta/_S_))*_S_);\n'
        '    matrices[out_mat][2][0] = fint(((vectors[axis][2]/_S_) * (vectors[axis][0]/_S_) *\n'
        '                                (1 - cos(theta/_S_)) - (vectors[axis][1]/_S_) * sin(theta/_S_))*_S_);\n'
        '    matrices[out_mat][2][1] = fint(((vectors[axis][2]/_S_) * (vectors[axis][1]/_S_) *\n'
        '                                (1 - cos(theta/_S_)) + (vectors[axis][0]/_S_) * sin(theta/_S_))*_S_);\n'
        '    matrices[out_mat][2][2] = fint((cos(theta/_S_) + squared(vectors[axis][2]/_S_) * (1 - cos(theta/_S_)))*_S_);\n'
        '}\n')
    put('\n')
    put('/************************************************ Motion of the needle ************************************************/\n'
        '\n'
        "// The tip's frame now: first the base, then the travel on the circle, then the roll.\n"
        'void update_tip_rotation_matrix() {\n'
        '    matrix_matrix_dot(TIP_CIRCLE_ROT_MAT, TIP_BASE_ROT_MAT, TEMP_MAT_1);\n'
        '    matrix_matrix_dot(TIP_ACTION_ROT_MAT, TEMP_MAT_1, TIP_ROT_MAT);\n'
        '}\n'
        '\n'
        '// A roll turns the tip about its direction of travel.\n'
        'void update_action_rotation_matrix() {\n'
        '    generate_rotation_matrix_from_axis_and_angle(TIP_X_VEC, tip_roll, TIP_ACTION_ROT_MAT);\n'
        '}\n'
        '\n'
        "// Travel on the circle turns the tip about the base's y-axis.\n"
        'void update_circle_rotation_matrix() {\n'
        '    matrix_vector_dot(TIP_BASE_ROT_MAT, GLOBAL_Y_VEC, TEMP_VEC_1);\n'
        '    normalize_vector(TEMP_VEC_1);\n'
        '    generate_rotation_matrix_from_axis_and_angle(TEMP_VEC_1, motion_circle_yaw, TIP_CIRCLE_ROT_MAT);\n'
        '}\n'
        '\n'
        '// A new base begins a new circle: nothing travelled, nothing rolled.\n'
        'void reset_data_after_base_rotation_update() {\n'
        '    copy_matrix(ID_MAT, TIP_CIRCLE_ROT_MAT);\n'
        '    copy_matrix(ID_MAT, TIP_ACTION_ROT_MAT);\n'
        '    motion_circle_yaw = 0;\n'
        '}\n'
        '\n'
        "// The tip's frame now becomes the base of what follows.\n"
        'void update_base_rotation_matrix() {\n'
        '    update_tip_rotation_matrix();\n'
        '    copy_matrix(TIP_ROT_MAT, TIP_BASE_ROT_MAT);\n'
        '\n'
        '    reset_data_after_base_rotation_update();\n'
        '}\n'
        '\n'
        "// The tip's axes, read off its frame.\n"
        'void update_needle_coordinate_system() {\n'
        '    matrix_vector_dot(TIP_ROT_MAT, GLOBAL_X_VEC, TIP_X_VEC);\n'
        '    normalize_vector(TIP_X_VEC);\n'
        '    matrix_vector_dot(TIP_ROT_MAT, GLOBAL_Y_VEC, TIP_Y_VEC);\n'
        '    normalize_vector(TIP_Y_VEC);\n'
        '    matrix_vector_dot(TIP_ROT_MAT, GLOBAL_Z_VEC, TIP_Z_VEC);\n'
        '    normalize_vector(TIP_Z_VEC);\n'
        '}\n'
        '\n'
        '// The motion circle touches the tip; its centre lies one radius behind the bevel: centre = tip - r * z-axis.\n'
        'void update_circle_center() {\n'
        '    double _S_ = _SI_*1.0;\n'
        '\n'
        '    update_tip_rotation_matrix();\n'
        '    update_needle_coordinate_system();\n'
        '    motion_circle_center[0] = fint((tip_pos[0]/_S_ - ((motion_circle_r/_S_) * (vectors[TIP_Z_VEC][0]/_S_))) * _S_);\n'
        '    motion_circle_center[1] = fint((tip_pos[1]/_S_ - ((motion_circle_r/_S_) * (vectors[TIP_Z_VEC][1]/_S_))) * _S_);\n'
        '    motion_circle_center[2] = fint((tip_pos[2]/_S_ - ((motion_circle_r/_S_) * (vectors[TIP_Z_VEC][2]/_S_))) * _S_);\n'
        '}\n'
        '\n'
        "// The tip on its circle: centre + r * (the base's z-axis, turned by the yaw).\n"
        'void update_tip_pos() {\n'
        '    double _S_ = _SI_*1.0;\n'
        '\n'
        '    update_circle_rotation_matrix();\n'
        '\n'
        '    matrix_vector_dot(TIP_BASE_ROT_MAT, GLOBAL_Z_VEC, TEMP_VEC_1);\n'
        '    matrix_vector_dot(TIP_CIRCLE_ROT_MAT, TEMP_VEC_1, TEMP_VEC_2);\n'
        '\n'
        '    tip_pos[0] = fint((motion_circle_center[0]/_S_ + (vectors[TEMP_VEC_2][0]/_S_) * (motion_circle_r/_S_)) * _S_);\n'
        '    tip_pos[1] = fint((motion_circle_center[1]/_S_ + (vectors[TEMP_VEC_2][1]/_S_) * (motion_circle_r/_S_)) * _S_);\n'
        '    tip_pos[2] = fint((motion_circle_center[2]/_S_ + (vectors[TEMP_VEC_2][2]/_S_) * (motion_circle_r/_S_)) * _S_);\n'
        '\n'
        '    update_tip_rotation_matrix();\n'
        '    update_needle_coordinate_system();\n'
        '}\n'
        '\n'
        '// Rolls the needle by an angle in rad. The tip stays where it is, the circle turns about the direction of travel.\n'
        'void rotate_rad(fixed_t angle) {\n'
        '    tip_roll = angle;\n'
        '    update_action_rotation_matrix();\n'
        '    update_circle_center();\n'
        '\n'
        '    update_base_rotation_matrix();')
    if model.free_bevel:
        put('\n'
            '\n'
            '    // Before the entry, the first roll chooses the direction of the bevel, and does not count.\n'
            '    if (needle_progress > 0 || prev_ROT_index > 1) {\n'
            '        ROT_counter++;\n'
            '    }')
    else:
        put('\n'
            '\n'
            '    ROT_counter++;')
    put('\n'
        '}\n'
        '\n'
        '// Rolls the needle by an angle in degrees.\n'
        'void rotate_deg(fixed_t angle) {\n'
        '    rotate_rad(fint(((angle/180.0) * PI * _SI_)));\n'
        '}\n'
        '\n'
        '// One push of duration dt: the tip goes on along its circle.\n'
        'void step() {\n'
        '    fixed_t needle_pos_delta, tip_yaw_delta;\n'
        '    double _S_ = _SI_*1.0;\n'
        '\n'
        '    needle_pos_delta = fint(((needle_vel/_S_) * dt) * _S_);\n'
        '    tip_yaw_delta = fint(((needle_pos_delta/_S_) / (motion_circle_r/_S_)) * _S_);\n'
        '\n'
        '    needle_progress += needle_pos_delta;\n'
        '    motion_circle_yaw += tip_yaw_delta;\n'
        '    update_tip_pos();\n'
        '}\n')
    put('\n')
    if model.adversary:
        put('/****************************************** The tissue as an opponent ******************************************/\n'
            '// A segment is what the tip travels from the entry or a roll to the next roll. In each of them the tissue picks once how\n'
            '// much the needle bends, and by how much the tip turned too far or too little at the roll before it: at the first push, so\n'
            '// that the user decides on the roll and on the first push without knowing it.\n'
            'const int BEND_COUNT = ')
        put(shown(len(model.adversary.radii)))
        put(';\n'
            'const fixed_t circle_radii[BEND_COUNT] = {')
        put(shown(', '.join(map(shown, model.adversary.radii))))
        put('};\n'
            'const int NOMINAL_BEND = ')
        put(shown(model.adversary.nominal_bend))
        put(';                  // What a segment has until the tissue picks.\n'
            'const int TWIST_COUNT = ')
        put(shown(len(model.adversary.twists)))
        put(';\n'
            'const fixed_t roll_errors[TWIST_COUNT] = {')
        put(shown(', '.join(map(shown, model.adversary.twists))))
        put('};     // In units of 1/_SI_ rad.\n'
            'const int NOMINAL_TWIST = ')
        put(shown(model.adversary.nominal_twist))
        put(';\n'
            'const int SEGMENT_COUNT = MAX_ROT_COUNT + 2;\n'
            'int segment = 0;                                      // The segment of the moment: so many rolls were made.\n'
            'int picks[SEGMENT_COUNT];                             // What was picked in each, from 1: bend and twist in one number.\n'
            'bool is_picked = false;                               // Whether the tissue has picked in this segment.\n'
            'bool is_new_pick = false;                             // Whether it did so in the action of the moment.\n'
            'bool is_pushing = false;                              // Whether the action of the moment is a push.\n'
            '\n'
            '// A roll begins a segment: the tissue will pick at its first push.\n'
            'void begin_segment() {\n'
            '    segment++;\n'
            '    is_picked = false;\n'
            '    is_pushing = false;\n'
            '    motion_circle_r = circle_radii[NOMINAL_BEND];\n'
            '}\n'
            '\n'
            "// What the tissue picks. There is no error of a roll before the first one: the bevel's direction at the entry is seen.\n"
            'void pick(int bend, int twist) {\n'
            '    is_picked = true;\n'
            '    is_new_pick = true;\n'
            '    picks[segment] = 1 + bend*TWIST_COUNT + twist;\n'
            '    if (bend == NOMINAL_BEND && twist == NOMINAL_TWIST) {\n'
            '        return;\n'
            '    }\n'
            '    motion_circle_r = circle_radii[bend];\n'
            '    tip_roll = roll_errors[twist];\n'
            '    update_action_rotation_matrix();\n'
            '    update_circle_center();\n'
            '    update_base_rotation_matrix();\n'
            '}\n'
            '\n')
    if model.spins:
        put('/***************************************************** Spinning *****************************************************/\n'
            '// A needle that spins about its shaft while it is inserted goes straight. If it does so in a part of each cycle of about a\n'
            '// millimetre, its curvature is less by that part. A segment is what the tip travels from the start or a roll to the next\n'
            '// roll. The first push of a segment chooses the spin, and the others keep it. The first choice is that of no spin.\n'
            'const int SPIN_COUNT = ')
        put(shown(len(model.spins)))
        put(';\n'
            'const fixed_t spin_radii[SPIN_COUNT] = {')
        put(shown(', '.join(map(shown, model.spins))))
        put('};\n'
            'int sel_spin = 0;                                     // The spin chosen last.\n'
            'bool is_spin_open = true;                             // Whether the next push chooses it.\n'
            '\n'
            '// Whether the last roll, by 0, said that the spin changes.\n'
            'bool check_spin_changes() {\n'
            '    return is_spin_open && prev_ROT_index >= 0 && sel_rot_angle == 0;\n'
            '}\n'
            '\n'
            '// Whether the next push may have a spin.\n'
            'bool check_spin_allowed(int spin_index) {\n'
            '    return is_spin_open ? (spin_index != sel_spin || !check_spin_changes()) : spin_index == sel_spin;\n'
            '}\n'
            '\n'
            '// A roll begins a segment.\n'
            'void begin_segment() {\n'
            '    is_spin_open = true;\n'
            '}\n'
            '\n'
            '// The spin of the next push. Another one has another circle, which touches the tip in the same direction.\n'
            'void choose_spin(int spin_index) {\n'
            '    int i;\n'
            '    double _S_ = _SI_*1.0;\n'
            '\n'
            '    is_spin_open = false;\n'
            '    if (spin_index == sel_spin) {\n'
            '        return;\n'
            '    }\n'
            '    sel_spin = spin_index;\n'
            '    motion_circle_r = spin_radii[spin_index];\n'
            '    for (i=0; i<3; i++) {\n'
            '        motion_circle_center[i] = fint((tip_pos[i]/_S_ - ((motion_circle_r/_S_) * (vectors[TIP_Z_VEC][i]/_S_))) * _S_);\n'
            '    }\n'
            '}\n'
            '\n')
    put("// The tip's axes and the first circle follow from the pose at the start.\n"
        'void initialize() {\n'
        '    update_circle_center();\n'
        '}\n'
        '\n'
        '/***************************************************** The automata *****************************************************/\n'
        '\n'
        'clock t;                                              // Time since the start; nothing is compared with it.\n'
        '\n'
        '/** Channels: all are broadcast, the sender waits for nobody **/\n'
        'broadcast chan do_tissue_action;                      // Needle -> Tissue: an action is done, react to it.\n'
        'broadcast chan finished_tissue_action;                // Tissue -> User: the reaction is done.\n'
        'broadcast chan do_check;                              // User -> Checker: look at the new state.\n'
        'broadcast chan finished_check;                        // Checker -> User: the path may go on.\n'
        'broadcast chan terminate;                             // Checker -> User: the path ends here.\n'
        'broadcast chan do_push;                               // User -> Needle: push for dt.\n'
        'broadcast chan do_rotate;                             // User -> Needle: roll by sel_rot_angle.')
    if model.moving:
        put('\n'
            'broadcast chan do_wait;                               // User -> Needle: rest for WAIT_TIME.')
    put('\n'
        '\n'
        '/** The log **/\n'
        '// All pushes since the last entry, as one entry.\n'
        'void log_push_action() {\n'
        '    actions[curr_ACT_index][ACT_PROG] = curr_ACT_index==0 ? 0 : actions[curr_ACT_index-1][ACT_PROG];\n'
        '    actions[curr_ACT_index][ACT_TYPE] = PUSH_ACTION;\n'
        '    actions[curr_ACT_index][ACT_VAL] = needle_progress - actions[curr_ACT_index][ACT_PROG];\n'
        '    curr_ACT_index++;\n'
        '}\n'
        '\n'
        '// The roll that was chosen.\n'
        'void log_rotation_action() {\n'
        '    actions[curr_ACT_index][ACT_PROG] = needle_progress;\n'
        '    actions[curr_ACT_index][ACT_TYPE] = ROLL_ROTATE_ACTION;\n'
        '    actions[curr_ACT_index][ACT_VAL] = sel_rot_angle;\n'
        '    prev_ROT_index = curr_ACT_index;\n'
        '    curr_ACT_index++;\n'
        '}\n'
        '\n'
        '/** What guards ask **/\n'
        '// Whether rolls are left.')
    if model.free_bevel:
        put(' Before the entry, the first one does not count.')
    put('\n'
        'bool check_rotation_left() {\n'
        '    return ROT_counter < MAX_ROT_COUNT')
    if model.free_bevel:
        put(' || (needle_progress == 0 && prev_ROT_index < 0)')
    put(';\n'
        '}\n'
        '\n'
        '// Whether the needle may be rolled: rolls are left, and the last one, if any, lies far enough behind.\n'
        'bool check_rotation_allowed() {\n'
        '    if (!check_rotation_left()) {\n'
        '        return false;\n'
        '    }\n'
        '    if (prev_ROT_index < 0) {\n'
        '        return true;\n'
        '    }\n'
        '    return ')
    if model.adversary:
        put('is_picked && ')
    put('needle_progress - actions[prev_ROT_index][ACT_PROG] >= MIN_PROG_BETWEEN_ROTS;\n'
        '}')
    if model.spins:
        put('\n'
            '\n'
            '// Whether it may be rolled by an angle: by 0 only where a push has chosen a spin, which changes then, and by no other before.\n'
            'bool check_angle_allowed(int angle) {\n'
            '    return angle == 0 ? !is_spin_open : !check_spin_changes();\n'
            '}')
    if model.swept:
        put('\n')
        put('/** The arc of the last push **/\n'
            "// Between two pushes the tip follows its circle. Written without rounding, with the circle's axis y (a unit vector), the\n"
            "// base's z-axis and the yaw a, the tip is at\n"
            '//     centre + r * (z cos a + (y x z) sin a + y (y . z) (1 - cos a)),\n'
            "// which is a circle about y. So the distance of a region's centre from the arc of one push has a closed form, and nothing\n"
            '// can lie between two samples: there are none.\n'
            '//\n'
            '// How far is the tip off this circle when it is rounded as in update_tip_pos? In units of a direction: an entry of the\n'
            '// rotation matrix is cut by at most 1, which adds up to at most sqrt(3) in a coordinate of its product with z (of length\n'
            "// 1), and the product's three terms are cut by at most 1 each: below 4.74 a coordinate, 8.3 in all. The model's y-axis is\n"
            '// cut as well, its length is off by at most 2: 2.1 more. So it is less than 11 units, times the radius; the cut of the\n'
            '// position itself adds less than 2. Regions are enlarged by that much, CIRCLE_MARGIN.\n'
            '\n'
            "// The axis and the z-axis of the circle, as the model's motion rounds them.\n"
            'void update_swept_axes() {\n'
            '    matrix_vector_dot(TIP_BASE_ROT_MAT, GLOBAL_Z_VEC, TEMP_VEC_1);\n'
            '    matrix_vector_dot(TIP_BASE_ROT_MAT, GLOBAL_Y_VEC, TEMP_VEC_2);\n'
            '    normalize_vector(TEMP_VEC_2);\n'
            '}\n'
            '\n'
            '// Whether the tip touched a sphere anywhere during the last push. Needs the axes of update_swept_axes().\n'
            'bool arc_touches(fixed_t center_x, fixed_t center_y, fixed_t center_z, fixed_t radius) {\n'
            '    double axis[3], start[3], side[3], offset[3];\n'
            '    double axis_length, axial, start_length, circle_r;\n'
            '    double height, ahead, aside, yaw_from, yaw_to, from_dist, to_dist, dist;\n'
            '    int i;\n'
            '    fixed_t needle_pos_delta, tip_yaw_delta;\n'
            '    double _S_ = _SI_*1.0;\n'
            '\n'
            '    // There is no arc before the first push on a circle.\n'
            '    if (motion_circle_yaw == 0) {\n'
            '        return false;\n'
            '    }\n'
            '\n'
            '    axis_length = sqrt(squared(vectors[TEMP_VEC_2][0]/_S_) +\n'
            '                       squared(vectors[TEMP_VEC_2][1]/_S_) +\n'
            '                       squared(vectors[TEMP_VEC_2][2]/_S_));\n'
            '    for (i=0; i<3; i++) {\n'
            '        axis[i] = (vectors[TEMP_VEC_2][i]/_S_) / axis_length;\n'
            '        start[i] = vectors[TEMP_VEC_1][i]/_S_;\n'
            '    }\n'
            '\n'
            "    // The circle's own axes: from its centre to the tip at yaw 0, and to the tip a quarter of a turn later.\n"
            '    axial = axis[0]*start[0] + axis[1]*start[1] + axis[2]*start[2];\n'
            '    for (i=0; i<3; i++) {\n'
            '        start[i] = start[i] - axial*axis[i];\n'
            '    }\n'
            '    start_length = sqrt(squared(start[0]) + squared(start[1]) + squared(start[2]));\n'
            '    circle_r = start_length * (motion_circle_r/_S_);\n'
            '    for (i=0; i<3; i++) {\n'
            '        start[i] = start[i] / start_length;\n'
            '    }\n'
            '    side[0] = axis[1]*start[2] - axis[2]*start[1];\n'
            '    side[1] = axis[2]*start[0] - axis[0]*start[2];\n'
            '    side[2] = axis[0]*start[1] - axis[1]*start[0];\n'
            '\n'
            "    // The region's centre, seen from the circle's centre along these axes.\n"
            '    offset[0] = center_x/_S_ - motion_circle_center[0]/_S_ - (motion_circle_r/_S_)*axial*axis[0];\n'
            '    offset[1] = center_y/_S_ - motion_circle_center[1]/_S_ - (motion_circle_r/_S_)*axial*axis[1];\n'
            '    offset[2] = center_z/_S_ - motion_circle_center[2]/_S_ - (motion_circle_r/_S_)*axial*axis[2];\n'
            '    height = offset[0]*axis[0] + offset[1]*axis[1] + offset[2]*axis[2];\n'
            '    ahead = offset[0]*start[0] + offset[1]*start[1] + offset[2]*start[2];\n'
            '    aside = offset[0]*side[0] + offset[1]*side[1] + offset[2]*side[2];\n'
            '\n'
            '    // The arc of the last push; see step(). It is less than half a circle.\n'
            '    needle_pos_delta = fint(((needle_vel/_S_) * dt) * _S_);\n'
            '    tip_yaw_delta = fint(((needle_pos_delta/_S_) / (motion_circle_r/_S_)) * _S_);\n'
            '    yaw_to = motion_circle_yaw/_S_;\n'
            '    yaw_from = (motion_circle_yaw - tip_yaw_delta)/_S_;\n'
            '\n'
            '    if (cos(yaw_from)*aside - sin(yaw_from)*ahead >= 0 && sin(yaw_to)*ahead - cos(yaw_to)*aside >= 0) {\n'
            '        // The centre is seen at an angle of the arc: the nearest point is there.\n'
            '        dist = sqrt(squared(sqrt(squared(ahead) + squared(aside)) - circle_r) + squared(height));\n'
            '    } else {\n'
            '        // Otherwise it is one of the two ends.\n'
            '        from_dist = squared(ahead - circle_r*cos(yaw_from)) + squared(aside - circle_r*sin(yaw_from));\n'
            '        to_dist = squared(ahead - circle_r*cos(yaw_to)) + squared(aside - circle_r*sin(yaw_to));\n'
            '        dist = sqrt((from_dist < to_dist ? from_dist : to_dist) + squared(height));\n'
            '    }\n'
            '    return fint(dist*_S_) - CIRCLE_MARGIN - radius <= 0;\n'
            '}\n')
    if model.solids.tables:
        put('\n'
            '\n')
        put('/************************************************ Shapes besides spheres ************************************************/\n'
            '// Their regions are in none of the tables above, but for the targets. Of each kind, the shapes to avoid come first: critical,\n'
            '// detection and unexplored ones alike; then those of targets. Lengths are in units; directions are in units of 1/_DIR_, as\n'
            '// they are multiplied by long ways. A distance is in mm, computed in doubles, and negative inside.\n'
            'const int _DIR_ = ')
        put(shown(model.solids.direction_units))
        put(';')
        for is_last_1, table in with_last(model.solids.tables):
            put('\n'
                '\n'
                'const int ')
            put(shown(table.kind))
            put('_COUNT = ')
            put(shown(table.count))
            put(';\n'
                'const int ')
            put(shown(table.kind))
            put('_AVOIDED = ')
            put(shown(table.still))
            put(';')
            for is_last_2, column in with_last(table.columns):
                put('\n'
                    'const fixed_t ')
                put(shown(table.kind))
                put('_')
                put(shown(column.name))
                put('[')
                put(shown(table.kind))
                put('_COUNT]')
                put(shown(column.dimensions))
                put(' = {     // ')
                put(shown(column.note))
                for is_last_3, row in with_last(column.rows):
                    put('\n'
                        '    ')
                    put(shown(row.text))
                    put(shown((',' if (not is_last_3) else '')))
                    put(shown(''.join(map(shown, ('  // ', row.note,)))))
                put('\n'
                    '};')
        if model.solids.samples:
            put('\n'
                '\n'
                '// The distances of shapes from files at the points of their grids, never greater than the true ones; of targets, the depths.')
            for is_last_1, note in with_last(model.solids.samples.notes):
                put('\n'
                    '// ')
                put(shown(note))
                put('.')
            put('\n'
                'const int FIELD_SAMPLES = ')
            put(shown(model.solids.samples.count))
            put(';\n'
                'typedef int[0, FIELD_SAMPLES] sample_t;               // A place in the table.\n'
                'const fixed_t FIELD_samples[FIELD_SAMPLES] = {')
            for is_last_1, (lines, note) in with_last(model.solids.samples.parts):
                put('\n'
                    '    // ')
                put(shown(note))
                put('\n'
                    '    ')
                put(shown(lines))
                put(shown((',' if (not is_last_1) else '')))
            put('\n'
                '};')
        kinds = list([one.kind for one in model.solids.tables])
        if ('BOX' in kinds):
            put('\n'
                '\n'
                '// A box: outside it is the length of what lies beyond its faces, inside the least depth below a face.\n'
                'double box_distance(int i, double x, double y, double z) {\n'
                '    double own, beyond, outside, inside;\n'
                '    int j;\n'
                '    double _S_ = _SI_*1.0;\n'
                '    double _D_ = _DIR_*1.0;\n'
                '    outside = 0.0;\n'
                '    inside = 0.0;\n'
                '    for (j=0; j<3; j++) {\n'
                '        own = (x - BOX_center[i][0]/_S_) * (BOX_axes[i][j][0]/_D_) +\n'
                '              (y - BOX_center[i][1]/_S_) * (BOX_axes[i][j][1]/_D_) +\n'
                '              (z - BOX_center[i][2]/_S_) * (BOX_axes[i][j][2]/_D_);\n'
                '        beyond = fabs(own) - BOX_half[i][j]/_S_;\n'
                '        if (beyond > 0) {\n'
                '            outside = outside + beyond*beyond;\n'
                '        }\n'
                '        if (j == 0 || beyond > inside) {\n'
                '            inside = beyond;\n'
                '        }\n'
                '    }\n'
                '    return (outside > 0 ? sqrt(outside) : inside) - BOX_rounding[i]/_S_;\n'
                '}')
        if ('CAPSULE' in kinds):
            put('\n'
                '\n'
                '// A capsule is the union of balls on its axis. The nearest of them stands at a place that depends on the slope of the radius.\n'
                'double capsule_distance(int i, double x, double y, double z) {\n'
                '    double seen_x, seen_y, seen_z, way_x, way_y, way_z, ahead, aside, slope, at, length;\n'
                '    double _S_ = _SI_*1.0;\n'
                '    double _D_ = _DIR_*1.0;\n'
                '    seen_x = x - CAPSULE_start[i][0]/_S_;\n'
                '    seen_y = y - CAPSULE_start[i][1]/_S_;\n'
                '    seen_z = z - CAPSULE_start[i][2]/_S_;\n'
                '    way_x = CAPSULE_way[i][0]/_D_;\n'
                '    way_y = CAPSULE_way[i][1]/_D_;\n'
                '    way_z = CAPSULE_way[i][2]/_D_;\n'
                '    ahead = seen_x*way_x + seen_y*way_y + seen_z*way_z;\n'
                '    seen_x = seen_x - ahead*way_x;\n'
                '    seen_y = seen_y - ahead*way_y;\n'
                '    seen_z = seen_z - ahead*way_z;\n'
                '    aside = sqrt(seen_x*seen_x + seen_y*seen_y + seen_z*seen_z);\n'
                '    length = CAPSULE_length[i]/_S_;\n'
                '    at = ahead;\n'
                '    slope = 0.0;\n'
                '    if (CAPSULE_radius[i] != CAPSULE_end_radius[i]) {\n'
                '        slope = (CAPSULE_radius[i]/_S_ - CAPSULE_end_radius[i]/_S_) / length;\n'
                '        at = ahead - aside * slope / sqrt(1 - slope*slope);\n'
                '    }\n'
                '    if (at < 0) {\n'
                '        at = 0.0;\n'
                '    }\n'
                '    if (at > length) {\n'
                '        at = length;\n'
                '    }\n'
                '    return sqrt((ahead - at)*(ahead - at) + aside*aside) - (CAPSULE_radius[i]/_S_ - slope * at);\n'
                '}')
        if ('CYLINDER' in kinds):
            put('\n'
                '\n'
                '// A cylinder: as a box, with one face around its axis and one for both ends.\n'
                'double cylinder_distance(int i, double x, double y, double z) {\n'
                '    double seen_x, seen_y, seen_z, way_x, way_y, way_z, ahead, around, beyond, dist;\n'
                '    double _S_ = _SI_*1.0;\n'
                '    double _D_ = _DIR_*1.0;\n'
                '    seen_x = x - CYLINDER_center[i][0]/_S_;\n'
                '    seen_y = y - CYLINDER_center[i][1]/_S_;\n'
                '    seen_z = z - CYLINDER_center[i][2]/_S_;\n'
                '    way_x = CYLINDER_way[i][0]/_D_;\n'
                '    way_y = CYLINDER_way[i][1]/_D_;\n'
                '    way_z = CYLINDER_way[i][2]/_D_;\n'
                '    ahead = seen_x*way_x + seen_y*way_y + seen_z*way_z;\n'
                '    seen_x = seen_x - ahead*way_x;\n'
                '    seen_y = seen_y - ahead*way_y;\n'
                '    seen_z = seen_z - ahead*way_z;\n'
                '    around = sqrt(seen_x*seen_x + seen_y*seen_y + seen_z*seen_z) - CYLINDER_radius[i]/_S_;\n'
                '    beyond = fabs(ahead) - CYLINDER_half[i]/_S_;\n'
                '    if (around > 0 && beyond > 0) {\n'
                '        dist = sqrt(around*around + beyond*beyond);\n'
                '    } else {\n'
                '        dist = around > beyond ? around : beyond;\n'
                '    }\n'
                '    return dist - CYLINDER_rounding[i]/_S_;\n'
                '}')
        if ('ELLIPSOID' in kinds):
            put('\n'
                '\n'
                "// An ellipsoid: the nearest point follows from the root of a falling and convex function, which Newton's iteration finds from\n"
                '// below (D. Eberly, "Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid"). In units of the least radius;\n'
                '// a point in a plane of symmetry is moved off it by a ten thousandth of a millionth. Far away, the distance to the ball around\n'
                '// it is enough: it is less.\n'
                'double ellipsoid_distance(int i, double x, double y, double z) {\n'
                '    double own[3], ratio[3], least, most, root, change, below, term, excess, fall, inside, dist;\n'
                '    int j, steps;\n'
                '    double _S_ = _SI_*1.0;\n'
                '    double _D_ = _DIR_*1.0;\n'
                '    least = ELLIPSOID_radius[i][0]/_S_;\n'
                '    most = least;\n'
                '    for (j=1; j<3; j++) {\n'
                '        if (ELLIPSOID_radius[i][j]/_S_ < least) {\n'
                '            least = ELLIPSOID_radius[i][j]/_S_;\n'
                '        }\n'
                '        if (ELLIPSOID_radius[i][j]/_S_ > most) {\n'
                '            most = ELLIPSOID_radius[i][j]/_S_;\n'
                '        }\n'
                '    }\n'
                '    dist = sqrt(squared(x - ELLIPSOID_center[i][0]/_S_) +\n'
                '                squared(y - ELLIPSOID_center[i][1]/_S_) +\n'
                '                squared(z - ELLIPSOID_center[i][2]/_S_));\n'
                '    if (dist > 2*most) {\n'
                '        return dist - most - ELLIPSOID_rounding[i]/_S_;\n'
                '    }\n'
                '    root = 0.0;\n'
                '    inside = 0.0;\n'
                '    for (j=0; j<3; j++) {\n'
                '        own[j] = fabs((x - ELLIPSOID_center[i][0]/_S_) * (ELLIPSOID_axes[i][j][0]/_D_) +\n'
                '                      (y - ELLIPSOID_center[i][1]/_S_) * (ELLIPSOID_axes[i][j][1]/_D_) +\n'
                '                      (z - ELLIPSOID_center[i][2]/_S_) * (ELLIPSOID_axes[i][j][2]/_D_)) / least;\n'
                '        if (own[j] < 0.0000000001) {\n'
                '            own[j] = 0.0000000001;\n'
                '        }\n'
                '        ratio[j] = (ELLIPSOID_radius[i][j]/_S_) / least;\n'
                '        inside = inside + squared(own[j]/ratio[j]);\n'
                '        below = ratio[j]*own[j] - (ratio[j]*ratio[j] - 1);\n'
                '        if (below > root) {\n'
                '            root = below;\n'
                '        }\n'
                '    }\n'
                '    change = root;\n'
                '    for (steps=0; steps<200 && change > 0.000000000000001*root; steps++) {\n'
                '        excess = 0.0 - 1.0;\n'
                '        fall = 0.0;\n'
                '        for (j=0; j<3; j++) {\n'
                '            below = root + ratio[j]*ratio[j] - 1;\n'
                '            term = squared(ratio[j]*own[j]/below);\n'
                '            excess = excess + term;\n'
                '            fall = fall + 2*term/below;\n'
                '        }\n'
                '        change = excess / fall;\n'
                '        if (change > 0) {\n'
                '            root = root + change;\n'
                '        }\n'
                '    }\n'
                '    dist = 0.0;\n'
                '    for (j=0; j<3; j++) {\n'
                '        dist = dist + squared(ratio[j]*ratio[j]*own[j] / (root + ratio[j]*ratio[j] - 1) - own[j]);\n'
                '    }\n'
                '    dist = least * sqrt(dist);\n'
                '    return (inside <= 1 ? 0.0 - dist : dist) - ELLIPSOID_rounding[i]/_S_;\n'
                '}')
        if ('HALFSPACE' in kinds):
            put('\n'
                '\n'
                '// A half-space: how far a point is before its plane.\n'
                'double halfspace_distance(int i, double x, double y, double z) {\n'
                '    double _S_ = _SI_*1.0;\n'
                '    double _D_ = _DIR_*1.0;\n'
                '    return (HALFSPACE_point[i][0]/_S_ - x) * (HALFSPACE_towards[i][0]/_D_) +\n'
                '           (HALFSPACE_point[i][1]/_S_ - y) * (HALFSPACE_towards[i][1]/_D_) +\n'
                '           (HALFSPACE_point[i][2]/_S_ - z) * (HALFSPACE_towards[i][2]/_D_);\n'
                '}')
        if ('FIELD' in kinds):
            put('\n'
                '\n'
                '// A field: a bound on the distance from the samples around a point. Trilinear weights w and the distances s to the samples d\n'
                '// give two: sum w d - sum w s, as a distance changes by no more than the way; and the root of sum w d^2 - sum w s^2 outside,\n'
                '// as the square of a distance to a set, minus the square of the place, is concave. Beyond the grid the way to it is taken\n'
                '// off, and the box around the solid is a bound as well. Of a target the samples are depths, so the bound is one on the depth.\n'
                'double field_distance(int i, double x, double y, double z) {\n'
                '    double own, step, weight, least, mean, squares, spread, beyond, outside, bound;\n'
                '    double share[3];\n'
                '    sample_t cell[3];\n'
                '    int j, a, b, c;\n'
                '    double _S_ = _SI_*1.0;\n'
                '    double _D_ = _DIR_*1.0;\n'
                '    mean = 0.0;\n'
                '    squares = 0.0;\n'
                '    spread = 0.0;\n'
                '    beyond = 0.0;\n'
                '    outside = 0.0;\n'
                '    for (j=0; j<3; j++) {\n'
                '        own = (x - FIELD_corner[i][0]/_S_) * (FIELD_axes[i][j][0]/_D_) +\n'
                '              (y - FIELD_corner[i][1]/_S_) * (FIELD_axes[i][j][1]/_D_) +\n'
                '              (z - FIELD_corner[i][2]/_S_) * (FIELD_axes[i][j][2]/_D_);\n'
                '        if (own < FIELD_low[i][j]/_S_) {\n'
                '            outside = outside + squared(own - FIELD_low[i][j]/_S_);\n'
                '        }\n'
                '        if (own > FIELD_high[i][j]/_S_) {\n'
                '            outside = outside + squared(own - FIELD_high[i][j]/_S_);\n'
                '        }\n'
                '        if (own < 0) {\n'
                '            beyond = beyond + own*own;\n'
                '            own = 0.0;\n'
                '        }\n'
                '        if (own > FIELD_extent[i][j]/_S_) {\n'
                '            beyond = beyond + squared(own - FIELD_extent[i][j]/_S_);\n'
                '            own = FIELD_extent[i][j]/_S_;\n'
                '        }\n'
                '        step = FIELD_extent[i][j]/_S_ / (FIELD_count[i][j] - 1);\n'
                '        cell[j] = fint(own/step);\n'
                '        if (cell[j] > FIELD_count[i][j] - 2) {\n'
                '            cell[j] = FIELD_count[i][j] - 2;\n'
                '        }\n'
                '        share[j] = own/step - cell[j];\n'
                '        spread = spread + step*step*share[j]*(1 - share[j]);\n'
                '    }\n'
                '    for (a=0; a<2; a++) {\n'
                '        for (b=0; b<2; b++) {\n'
                '            for (c=0; c<2; c++) {\n'
                '                weight = (a == 0 ? 1 - share[0] : share[0]) *\n'
                '                         (b == 0 ? 1 - share[1] : share[1]) *\n'
                '                         (c == 0 ? 1 - share[2] : share[2]);\n'
                '                least = FIELD_samples[FIELD_first[i] + ((cell[0] + a)*FIELD_count[i][1] + cell[1] + b)*FIELD_count[i][2] +\n'
                '                                      cell[2] + c]/_S_;\n'
                '                mean = mean + weight*least;\n'
                '                if (least > 0) {\n'
                '                    squares = squares + weight*least*least;\n'
                '                }\n'
                '            }\n'
                '        }\n'
                '    }\n'
                '    bound = mean - sqrt(spread);\n'
                '    squares = squares - spread;\n'
                '    if (squares > 0 && sqrt(squares) > bound) {\n'
                '        bound = sqrt(squares);\n'
                '    }\n'
                '    bound = bound - sqrt(beyond);\n'
                '    if (FIELD_side[i] < 0) {\n'
                '        return 0.0 - bound - FIELD_rounding[i]/_S_;\n'
                '    }\n'
                '    if (outside > 0 && sqrt(outside) > bound) {\n'
                '        bound = sqrt(outside);\n'
                '    }\n'
                '    return bound - FIELD_rounding[i]/_S_;\n'
                '}')
        if model.solids.is_avoided:
            put('\n'
                '\n'
                '// The distance to the nearest shape to avoid.\n'
                'double solid_distance(double x, double y, double z) {\n'
                '    double dist, least;\n'
                '    int i;\n'
                '    bool is_first = true;\n'
                '    least = 0.0;')
            for is_last_1, table in with_last([table for table in model.solids.tables if table.still]):
                put('\n'
                    '    for (i=0; i<')
                put(shown(table.kind))
                put('_AVOIDED; i++) {\n'
                    '        dist = ')
                put(shown(shown(table.kind).lower()))
                put('_distance(i, x, y, z);\n'
                    '        if (is_first || dist < least) {\n'
                    '            least = dist;\n'
                    '        }\n'
                    '        is_first = false;\n'
                    '    }')
            put('\n'
                '    return least;\n'
                '}')
            if model.swept:
                put('\n'
                    '\n'
                    '// Whether the tip touched such a shape anywhere during the last push. Needs the axes of update_swept_axes().\n'
                    '// A distance changes by no more than the way, so all points of the arc within the distance of one of them are free: the next\n'
                    '// point to ask about is that far ahead. Where it is less than a 64th of the push, a touch is assumed, so the shapes count as\n'
                    '// if they were larger by this much and by CIRCLE_MARGIN. The circle is that of arc_touches.\n'
                    'bool arc_touches_solid() {\n'
                    '    double axis[3], start[3], side[3], middle[3], point[3];\n'
                    '    double axis_length, axial, circle_r, yaw, yaw_from, yaw_to, dist;\n'
                    '    int i;\n'
                    '    fixed_t needle_pos_delta, tip_yaw_delta;\n'
                    '    double _S_ = _SI_*1.0;\n'
                    '\n'
                    '    if (motion_circle_yaw == 0) {\n'
                    '        return false;\n'
                    '    }\n'
                    '    axis_length = sqrt(squared(vectors[TEMP_VEC_2][0]/_S_) +\n'
                    '                       squared(vectors[TEMP_VEC_2][1]/_S_) +\n'
                    '                       squared(vectors[TEMP_VEC_2][2]/_S_));\n'
                    '    for (i=0; i<3; i++) {\n'
                    '        axis[i] = (vectors[TEMP_VEC_2][i]/_S_) / axis_length;\n'
                    '        start[i] = vectors[TEMP_VEC_1][i]/_S_;\n'
                    '    }\n'
                    '    axial = axis[0]*start[0] + axis[1]*start[1] + axis[2]*start[2];\n'
                    '    for (i=0; i<3; i++) {\n'
                    '        middle[i] = motion_circle_center[i]/_S_ + (motion_circle_r/_S_)*axial*axis[i];\n'
                    '        start[i] = (motion_circle_r/_S_) * (start[i] - axial*axis[i]);\n'
                    '    }\n'
                    '    circle_r = sqrt(squared(start[0]) + squared(start[1]) + squared(start[2]));\n'
                    '    side[0] = axis[1]*start[2] - axis[2]*start[1];\n'
                    '    side[1] = axis[2]*start[0] - axis[0]*start[2];\n'
                    '    side[2] = axis[0]*start[1] - axis[1]*start[0];\n'
                    '\n'
                    '    needle_pos_delta = fint(((needle_vel/_S_) * dt) * _S_);\n'
                    '    tip_yaw_delta = fint(((needle_pos_delta/_S_) / (motion_circle_r/_S_)) * _S_);\n'
                    '    yaw_from = (motion_circle_yaw - tip_yaw_delta)/_S_;\n'
                    '    yaw_to = motion_circle_yaw/_S_;\n'
                    '    yaw = yaw_from;\n'
                    '    while (yaw <= yaw_to) {\n'
                    '        for (i=0; i<3; i++) {\n'
                    '            point[i] = middle[i] + start[i]*cos(yaw) + side[i]*sin(yaw);\n'
                    '        }\n'
                    '        dist = solid_distance(point[0], point[1], point[2]) - CIRCLE_MARGIN/_S_;\n'
                    '        if (dist <= circle_r*(yaw_to - yaw_from)/64.0) {\n'
                    '            return true;\n'
                    '        }\n'
                    '        yaw = yaw + dist/circle_r;\n'
                    '    }\n'
                    '    return false;\n'
                    '}')
        if model.solids.targets:
            put('\n'
                '\n'
                '/** Targets of such shapes: the kind of the shape (0 is a sphere), its place in its tables, and where it ends below **/\n'
                '// Their entries in TR_center and TR_radius are a ball around them.\n'
                'const int TR_form[TR_COUNT] = {')
            for is_last_1, target in with_last(model.solids.targets):
                put('\n'
                    '    ')
                put(shown(target.form))
                put(shown((',' if (not is_last_1) else '')))
                put('  // ')
                put(shown(target.note))
            put('\n'
                '};\n'
                'const int TR_place[TR_COUNT] = {')
            put(shown(', '.join(map(shown, [one.place for one in model.solids.targets]))))
            put('};\n'
                'const fixed_t TR_low[TR_COUNT] = {')
            put(shown(', '.join(map(shown, [one.low for one in model.solids.targets]))))
            put('};')
            if model.moving:
                put('\n'
                    '\n'
                    '// The distance of a place to a target that is no sphere.\n'
                    'double solid_target_distance(int TR_index, double x, double y, double z) {\n'
                    '    int i = TR_place[TR_index];')
            else:
                put('\n'
                    '\n'
                    '// The distance of the tip to a target that is no sphere.\n'
                    'double solid_target_distance(int TR_index) {\n'
                    '    int i = TR_place[TR_index];\n'
                    '    double _S_ = _SI_*1.0;')
            for is_last_1, table in with_last([table for table in model.solids.tables if (table.count > table.avoided)]):
                put('\n'
                    '    if (TR_form[TR_index] == ')
                put(shown(table.form))
                put(') {\n'
                    '        return ')
                put(shown(shown(table.kind).lower()))
                put('_distance(i, ')
                if model.moving:
                    put('x, y, z')
                else:
                    put('tip_pos[0]/_S_, tip_pos[1]/_S_, tip_pos[2]/_S_')
                put(');\n'
                    '    }')
            put('\n'
                '    return 1.0;\n'
                '}')
        put('\n')
    if model.moving:
        put('\n'
            '\n')
        moving = model.moving
        put('\n'
            '/*************************************************** Moving regions ***************************************************/\n'
            '// Regions move with the breath, and come back to the same place after each period. Time is counted by `cycle`, modulo the\n'
            '// period: it is the clock t, which functions cannot read, and goes on with each push and each wait. A roll takes no time here.\n'
            '// A displacement stands for PERIOD/MOVE_ROWS units of time. A region is nowhere farther from it than MOVE_slack, in units: how far\n'
            '// it moves in half of that time (0 if that is one unit, for the instants of the model), and two units for rounding. Regions to\n'
            '// avoid count as so much larger, targets as so much smaller.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const int PERIOD = ', moving.period, ';',))),))))
        put(' // One breath, in units of time.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const int PUSH_TIME = ', moving.push, ';',))),))))
        put(' // One push.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const int WAIT_TIME = ', moving.wait, ';',))),))))
        put(' // One wait.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const int MAX_PAUSES = ', moving.max_pauses, ';',))),))))
        put(' // Places, at most, where it waits although it may be pushed.')
        if (not (moving.gate_from is None)):
            put('\n')
            put(shown(('%-53s' % (''.join(map(shown, ('const int GATE_FROM = ', moving.gate_from, ';',))),))))
            put(' // When the gate opens: pushes are made only while it is open.\n')
            put(shown(('%-53s' % (''.join(map(shown, ('const int GATE_WIDTH = ', moving.gate_width, ';',))),))))
            put(' // How long it is open.')
        put('\n'
            '\n'
            'int[0, PERIOD - 1] cycle = 0;                         // Time since the start, modulo the period.\n'
            'int[0, PERIOD] waited = 0;                            // How long it has waited at this place.\n'
            'int[0, MAX_PAUSES] pauses = 0;                        // Where it waited although it may be pushed, so far.\n'
            'bool is_pause = false;                                // Whether this place is one of them.\n'
            'int[0, PERIOD] rested = 0;                            // How long it has rested in the last action.')
        if moving.courses:
            put('\n'
                '\n'
                'const int MOVE_COUNT = ')
            put(shown(len(moving.courses)))
            put(';\n'
                'const int MOVE_ROWS = ')
            put(shown(moving.row_count))
            put(';\n'
                'const fixed_t MOVE[MOVE_COUNT][MOVE_ROWS][3] = {')
            for is_last_1, course in with_last(moving.courses):
                put('\n'
                    '    {')
                for is_last_2, row in with_last(course.rows):
                    put(shown(row))
                    put(shown((', ' if (not is_last_2) else '')))
                put('}')
                put(shown((',' if (not is_last_1) else '')))
            put('\n'
                '};\n'
                'const fixed_t MOVE_slack[MOVE_COUNT] = {')
            put(shown(', '.join(map(shown, [one.slack for one in moving.courses]))))
            put('};\n'
                'const fixed_t MOVE_reach[MOVE_COUNT] = {')
            put(shown(', '.join(map(shown, [one.reach for one in moving.courses]))))
            put('};   // The farthest from rest.\n'
                'const fixed_t MOVE_span[MOVE_COUNT] = {')
            put(shown(', '.join(map(shown, [one.span for one in moving.courses]))))
            put('};    // Between two places, at most.\n'
                '\n'
                '// The row of a time within the period.\n'
                'int move_row(fixed_t time) {\n'
                '    return time * MOVE_ROWS / PERIOD;\n'
                '}')
        if moving.has_targets:
            put('\n'
                '\n'
                '/** Targets that move: which row of MOVE is theirs; -1 for the others **/\n'
                'const int TR_course[TR_COUNT] = {')
            put(shown(', '.join(map(shown, moving.target_courses))))
            put('};\n'
                '\n'
                '// How far a target gets from its place at rest.\n'
                'fixed_t target_reach(int TR_index) {\n'
                '    return TR_course[TR_index] < 0 ? 0 : MOVE_reach[TR_course[TR_index]];\n'
                '}')
        put('\n'
            '\n'
            '/** What takes time **/\n'
            'void pass_time(fixed_t time) {\n'
            '    cycle = (cycle + time) % PERIOD;\n'
            '}\n'
            '\n'
            '// After a push: it is somewhere else, and has not rested.\n'
            'void end_push() {\n'
            '    pass_time(PUSH_TIME);\n'
            '    waited = 0;\n'
            '    is_pause = false;\n'
            '    rested = 0;\n'
            '}\n'
            '\n'
            '// A roll takes some time in truth. The needle then rests until the breath is where it was, so it rests for a whole period.\n'
            'void end_roll() {\n'
            '    waited = 0;\n'
            '    is_pause = false;\n'
            '    rested = PERIOD;\n'
            '}\n'
            '\n'
            '// Whether a push may begin now.\n'
            'bool check_push_allowed() {')
        if (not (moving.gate_from is None)):
            put('\n'
                '    return (cycle - GATE_FROM + PERIOD) % PERIOD + PUSH_TIME <= GATE_WIDTH;')
        else:
            put('\n'
                '    return true;')
        put('\n'
            '}\n'
            '\n'
            '// Whether it may wait: while no push may begin; else at few places, and less than a period at each.\n'
            'bool check_wait_allowed() {\n'
            '    return !check_push_allowed() || ((is_pause || pauses < MAX_PAUSES) && waited + WAIT_TIME < PERIOD);\n'
            '}\n'
            '\n'
            '// A wait begins.\n'
            'void begin_wait() {\n'
            '    if (check_push_allowed() && !is_pause) {\n'
            '        is_pause = true;\n'
            '        pauses++;\n'
            '    }\n'
            '}\n'
            '\n'
            'void end_wait() {\n'
            '    pass_time(WAIT_TIME);\n'
            '    waited = waited + WAIT_TIME > PERIOD ? PERIOD : waited + WAIT_TIME;\n'
            '    rested = WAIT_TIME < PERIOD ? WAIT_TIME : PERIOD;\n'
            '}')
        if moving.movers:
            put('\n'
                '\n'
                '/** Regions to avoid that move **/\n'
                '// For each a ball around it at rest, which is the region itself if its form is 0; else its shape, and its place in the tables\n'
                '// of that shape. A critical one must not reach the needle behind the tip either, which lies where the tip went.\n'
                'const int MR_COUNT = ')
            put(shown(len(moving.movers)))
            put(';\n'
                'const fixed_t MR_center[MR_COUNT][3] = {')
            for is_last_1, mover in with_last(moving.movers):
                put('\n'
                    '    ')
                put(shown(mover.center))
                put(shown((',' if (not is_last_1) else '')))
                put('  // ')
                put(shown(mover.note))
            put('\n'
                '};\n'
                'const fixed_t MR_radius[MR_COUNT] = {')
            put(shown(', '.join(map(shown, [one.radius for one in moving.movers]))))
            put('};\n'
                'const int MR_form[MR_COUNT] = {')
            put(shown(', '.join(map(shown, [one.form for one in moving.movers]))))
            put('};\n'
                'const int MR_place[MR_COUNT] = {')
            put(shown(', '.join(map(shown, [one.place for one in moving.movers]))))
            put('};\n'
                'const int MR_course[MR_COUNT] = {')
            put(shown(', '.join(map(shown, [one.course for one in moving.movers]))))
            put('};\n'
                'const bool MR_critical[MR_COUNT] = {')
            for is_last_1, mover in with_last(moving.movers):
                put(shown(('true' if mover.is_critical else 'false')))
                put(shown((', ' if (not is_last_1) else '')))
            put('};\n'
                '\n'
                '// The distance of the tip to such a region, or less if it is more than a length.\n'
                'double moving_distance(int i, int row, double enough) {\n'
                '    double dist, x, y, z;\n'
                '    double _S_ = _SI_*1.0;\n'
                '    x = tip_pos[0]/_S_ - MOVE[MR_course[i]][row][0]/_S_;\n'
                '    y = tip_pos[1]/_S_ - MOVE[MR_course[i]][row][1]/_S_;\n'
                '    z = tip_pos[2]/_S_ - MOVE[MR_course[i]][row][2]/_S_;\n'
                '    dist = sqrt(squared(MR_center[i][0]/_S_ - x) + squared(MR_center[i][1]/_S_ - y) + squared(MR_center[i][2]/_S_ - z)) -\n'
                '           MR_radius[i]/_S_;\n'
                '    if (MR_form[i] == 0 || dist > enough) {\n'
                '        return dist;\n'
                '    }')
            for is_last_1, table in with_last([table for table in model.solids.tables if (table.form in moving.forms)]):
                put('\n'
                    '    if (MR_form[i] == ')
                put(shown(table.form))
                put(') {\n'
                    '        return ')
                put(shown(shown(table.kind).lower()))
                put('_distance(MR_place[i], x, y, z);\n'
                    '    }')
            put('\n'
                '    return dist;\n'
                '}\n'
                '\n'
                '// How long the needle still lies where the tip is, at least: until the tip is in the target that is sought.\n'
                'fixed_t time_to_target() {\n'
                '    double dist, push;\n'
                '    double _S_ = _SI_*1.0;\n'
                '    if (curr_TR_index >= TR_COUNT) {\n'
                '        return 0;\n'
                '    }\n'
                '    dist = sqrt(squared(TR_center[curr_TR_index][0]/_S_ - tip_pos[0]/_S_) +\n'
                '                squared(TR_center[curr_TR_index][1]/_S_ - tip_pos[1]/_S_) +\n'
                '                squared(TR_center[curr_TR_index][2]/_S_ - tip_pos[2]/_S_)) - TR_radius[curr_TR_index]/_S_')
            if moving.has_targets:
                put(' - target_reach(curr_TR_index)/_S_')
            put(';\n'
                '    push = needle_vel/_S_ * dt;\n'
                '    if (dist <= 0) {\n'
                '        return 0;\n'
                '    }\n'
                '    return dist >= push * PERIOD / PUSH_TIME ? PERIOD : fint(dist / push) * PUSH_TIME;\n'
                '}\n'
                '\n'
                '// Whether a region touches the tip now, or has done so in a rest that ends now; for critical ones also whether it comes to\n'
                '// this place while the needle still lies here.')
            if model.swept:
                put(' During a push the tip was no farther away than the push is long, so regions count as so much larger.')
            put('\n'
                'bool moving_region_touches() {\n'
                '    int i, k, first;\n'
                '    fixed_t ahead, count;\n'
                '    double grown, dist;\n'
                '    double _S_ = _SI_*1.0;')
            if model.swept:
                put('\n'
                    '    fixed_t before = rested > 0 ? rested : PUSH_TIME;\n'
                    '    double pushed = rested > 0 ? 0.0 : (needle_vel/_S_ * dt) + CIRCLE_MARGIN/_S_;')
            else:
                put('\n'
                    '    fixed_t before = rested;\n'
                    '    double pushed = 0.0;')
            put('\n'
                '\n'
                '    ahead = time_to_target();\n'
                '    if (before > PERIOD - 1) {\n'
                '        before = PERIOD - 1;\n'
                '    }\n'
                '    first = move_row((cycle - before + PERIOD) % PERIOD);\n'
                '    for (i=0; i<MR_COUNT; i++) {\n'
                '        grown = MOVE_slack[MR_course[i]]/_S_ + pushed;\n'
                '        dist = moving_distance(i, move_row(cycle), grown + MOVE_span[MR_course[i]]/_S_);\n'
                '        if (dist <= grown + MOVE_span[MR_course[i]]/_S_) {\n'
                '            count = (before + (MR_critical[i] ? ahead : 0)) * MOVE_ROWS / PERIOD + (PERIOD > MOVE_ROWS ? 1 : 0);\n'
                '            if (count > MOVE_ROWS - 1) {\n'
                '                count = MOVE_ROWS - 1;\n'
                '            }\n'
                '            for (k=0; k<=count; k++) {\n'
                '                if (moving_distance(i, (first + k) % MOVE_ROWS, grown) <= grown) {\n'
                '                    return true;\n'
                '                }\n'
                '            }\n'
                '        }\n'
                '    }\n'
                '    return false;\n'
                '}')
        put('\n')
    put('\n'
        '\n')
    put("// Where a target region lies as the tip sees it: ahead of it, beside it, and above it, away from the circle's centre.\n"
        'void look_at(int TR_index, double &place[3]) {\n'
        '    double _S_ = _SI_*1.0;\n'
        '    double dx = TR_center[TR_index][0]/_S_ - tip_pos[0]/_S_;\n'
        '    double dy = TR_center[TR_index][1]/_S_ - tip_pos[1]/_S_;\n'
        '    double dz = TR_center[TR_index][2]/_S_ - tip_pos[2]/_S_;\n'
        '    place[0] = (dx*vectors[TIP_X_VEC][0] + dy*vectors[TIP_X_VEC][1] + dz*vectors[TIP_X_VEC][2])/_S_;\n'
        '    place[1] = (dx*vectors[TIP_Y_VEC][0] + dy*vectors[TIP_Y_VEC][1] + dz*vectors[TIP_Y_VEC][2])/_S_;\n'
        '    place[2] = (dx*vectors[TIP_Z_VEC][0] + dy*vectors[TIP_Z_VEC][1] + dz*vectors[TIP_Z_VEC][2])/_S_;\n'
        '}\n'
        '\n'
        '/** What guides the search: it is no part of the question, and a wrong answer only costs time **/\n'
        '// How near the tip comes to the target if it goes on along its circle, or after one more roll if there may be one.')
    if model.spins:
        put('\n'
            '// It may have any spin after the roll.')
    put('\n'
        'fixed_t get_miss() {\n'
        '    int i, angle_count')
    if model.spins:
        put(', spin')
    put(';\n'
        '    double place[3];\n'
        '    double _S_ = _SI_*1.0;\n'
        '    double r = motion_circle_r/_S_;\n'
        '    double angle, in_plane, off_plane, off_circle, miss, least = 0.0;\n'
        '\n'
        '    look_at(curr_TR_index, place);\n'
        '    angle_count = check_rotation_left() ? ANGLE_COUNT : 0;\n'
        '    for (i=-1; i<angle_count; i++) {\n'
        '        angle = i < 0 ? 0.0 : allowed_rot_angles[i]/180.0 * PI;\n'
        '        // The target in the plane of the circle, and its distance from that plane.\n'
        '        in_plane = place[2] * cos(angle) - place[1] * sin(angle);\n'
        '        off_plane = place[2] * sin(angle) + place[1] * cos(angle);')
    if model.spins:
        put('\n'
            '        for (spin=0; spin<SPIN_COUNT; spin++) {\n'
            '            if (i >= 0 || is_spin_open || spin == sel_spin) {\n'
            '                r = spin_radii[spin]/_S_;\n'
            '                off_circle = sqrt(place[0]*place[0] + (r + in_plane)*(r + in_plane)) - r;\n'
            '                miss = sqrt(off_circle*off_circle + off_plane*off_plane);\n'
            '                if ((i < 0 && (spin == 0 || !is_spin_open)) || miss < least) {\n'
            '                    least = miss;\n'
            '                }\n'
            '            }\n'
            '        }')
    else:
        put('\n'
            '        off_circle = sqrt(place[0]*place[0] + (r + in_plane)*(r + in_plane)) - r;\n'
            '        miss = sqrt(off_circle*off_circle + off_plane*off_plane);\n'
            '        if (i < 0 || miss < least) {\n'
            '            least = miss;\n'
            '        }')
    put('\n'
        '    }\n'
        '    return fint(least*_S_);\n'
        '}\n'
        '\n'
        '/** What the Checker asks; the answers are kept in variables, which its guards read **/\n'
        '// Whether the tip has entered a critical region (or a detection region, if these count as critical). Touching counts.\n'
        'bool CR_reached = false;\n'
        'bool check_CR_reached() {\n'
        '    fixed_t tip_center_dist, tip_region_dist;\n'
        '    int i;\n'
        '    double _S_ = _SI_*1.0;\n'
        '    CR_reached = false;')
    if model.swept:
        put('\n'
            '    update_swept_axes();')
    if model.solids.is_avoided:
        put('\n'
            '\n'
            '    if (solid_distance(tip_pos[0]/_S_, tip_pos[1]/_S_, tip_pos[2]/_S_)*_S_ < 1')
        if model.swept:
            put(' || arc_touches_solid()')
        put(') {\n'
            '        CR_reached = true;\n'
            '        return CR_reached;\n'
            '    }')
    if (model.moving and model.moving.movers):
        put('\n'
            '\n'
            '    if (moving_region_touches()) {\n'
            '        CR_reached = true;\n'
            '        return CR_reached;\n'
            '    }')
    put('\n'
        '\n'
        '    if (!HAS_CRITICAL_REGIONS && !HAS_DETECTION_REGIONS')
    if model.unexplored.count:
        put(' && UR_COUNT == 0')
    put(') {\n'
        '        CR_reached = false;\n'
        '        return CR_reached;\n'
        '    }')
    if model.unexplored.count:
        put('\n'
            '\n'
            '    for (i=0; i<UR_COUNT; i++) {\n'
            '        tip_center_dist = fint(sqrt(\n'
            '            squared(UR_center[i][0]/_S_ - tip_pos[0]/_S_) +\n'
            '            squared(UR_center[i][1]/_S_ - tip_pos[1]/_S_) +\n'
            '            squared(UR_center[i][2]/_S_ - tip_pos[2]/_S_))*_S_);\n'
            '        tip_region_dist = tip_center_dist - UR_radius[i];\n'
            '        if (tip_region_dist <= 0')
        if model.swept:
            put(' || arc_touches(UR_center[i][0], UR_center[i][1], UR_center[i][2], UR_radius[i])')
        put(') {\n'
            '            CR_reached = true;\n'
            '            return CR_reached;\n'
            '        }\n'
            '    }')
    put('\n'
        '\n'
        '    for (i=0; i<CR_COUNT; i++) {\n'
        '        tip_center_dist = fint(sqrt(\n'
        '            squared(CR_center[i][0]/_S_ - tip_pos[0]/_S_) +\n'
        '            squared(CR_center[i][1]/_S_ - tip_pos[1]/_S_) +\n'
        '            squared(CR_center[i][2]/_S_ - tip_pos[2]/_S_))*_S_);\n'
        '        tip_region_dist = tip_center_dist - CR_radius[i];\n'
        '        if (tip_region_dist <= 0')
    if model.swept:
        put(' || arc_touches(CR_center[i][0], CR_center[i][1], CR_center[i][2], CR_radius[i])')
    put(') {\n'
        '            CR_reached = true;\n'
        '            return CR_reached;\n'
        '        }\n'
        '    }\n'
        '\n'
        '    if (TREAT_DR_AS_CR) {\n'
        '        if (!HAS_DETECTION_REGIONS) {\n'
        '            CR_reached = false;\n'
        '            return CR_reached;\n'
        '        }\n'
        '\n'
        '        for (i=0; i<DR_COUNT; i++) {\n'
        '            tip_center_dist = fint(sqrt(\n'
        '                squared(DR_center[i][0]/_S_ - tip_pos[0]/_S_) +\n'
        '                squared(DR_center[i][1]/_S_ - tip_pos[1]/_S_) +\n'
        '                squared(DR_center[i][2]/_S_ - tip_pos[2]/_S_))*_S_);\n'
        '            tip_region_dist = tip_center_dist - DR_radius[i];\n'
        '            if (tip_region_dist <= 0')
    if model.swept:
        put(' || arc_touches(DR_center[i][0], DR_center[i][1], DR_center[i][2], DR_radius[i])')
    put(') {\n'
        '                CR_reached = true;\n'
        '                return CR_reached;\n'
        '            }\n'
        '        }\n'
        '    }\n'
        '\n'
        '    return CR_reached;\n'
        '}\n'
        '\n'
        '// Whether the tip lies in a target region. Touching counts.\n'
        'bool TR_reached = false;\n'
        'bool check_specific_TR_reached(int TR_index) {\n'
        '    double tip_center_dist, tip_region_dist;')
    if (model.moving and model.moving.has_targets):
        put('\n'
            '    fixed_t slack = 0;\n'
            '    int i, row;\n'
            '    double at[3];\n'
            '    double _S_ = _SI_*1.0;')
    put('\n'
        '    TR_reached = false;')
    if (model.moving and model.moving.has_targets):
        put('\n'
            '    if (TR_course[TR_index] >= 0) {\n'
            '        // The target stands still, and the tip moves the other way.\n'
            '        row = move_row(cycle);\n'
            '        slack = MOVE_slack[TR_course[TR_index]];\n'
            '        for (i=0; i<3; i++) {\n'
            '            at[i] = tip_pos[i]/_S_ - MOVE[TR_course[TR_index]][row][i]/_S_;\n'
            '        }')
        if model.solids.targets:
            put('\n'
                '        if (TR_form[TR_index] != 0) {\n'
                '            TR_reached = solid_target_distance(TR_index, at[0], at[1], at[2])*_S_ <= 0 - slack;\n'
                '            return TR_reached;\n'
                '        }')
        put('\n'
            '        tip_center_dist = sqrt(squared(TR_center[TR_index][0]/_S_ - at[0]) +\n'
            '                               squared(TR_center[TR_index][1]/_S_ - at[1]) +\n'
            '                               squared(TR_center[TR_index][2]/_S_ - at[2]));\n'
            '        TR_reached = tip_center_dist*_S_ <= TR_radius[TR_index] - slack;\n'
            '        return TR_reached;\n'
            '    }')
    if model.solids.targets:
        put('\n'
            '    if (TR_form[TR_index] != 0) {\n'
            '        TR_reached = solid_target_distance(TR_index')
        if model.moving:
            put(', tip_pos[0]/(_SI_*1.0), tip_pos[1]/(_SI_*1.0), tip_pos[2]/(_SI_*1.0)')
        put(') <= 0;\n'
            '        return TR_reached;\n'
            '    }')
    put('\n'
        '    tip_center_dist = sqrt(squared(TR_center[TR_index][0] - tip_pos[0]) +\n'
        '                           squared(TR_center[TR_index][1] - tip_pos[1]) +\n'
        '                           squared(TR_center[TR_index][2] - tip_pos[2]));\n'
        '    tip_region_dist = tip_center_dist - TR_radius[TR_index];\n'
        '    if (tip_region_dist <= 0) {\n'
        '        TR_reached = true;\n'
        '    }\n'
        '    return TR_reached;\n'
        '}\n'
        'bool check_TR_reached() {\n'
        '    return check_specific_TR_reached(curr_TR_index);\n'
        '}\n'
        '\n')
    if model.only_plans:
        put('// Whether the whole motion circle passes by a target region. With no roll left, the tip stays on this circle; how far it\n'
            '// may be off it by rounding, CIRCLE_MARGIN, is derived at the check of the path between two pushes (sweep.c.jinja).\n'
            'bool circle_misses(int TR_index) {\n'
            '    double axis[3], start[3], offset[3];\n'
            '    double axis_length, start_length, axial, height, across, dist;\n'
            '    int i;\n'
            '    double _S_ = _SI_*1.0;\n'
            '\n'
            '    axis_length = sqrt(squared(matrices[TIP_BASE_ROT_MAT][0][1]/_S_) +\n'
            '                       squared(matrices[TIP_BASE_ROT_MAT][1][1]/_S_) +\n'
            '                       squared(matrices[TIP_BASE_ROT_MAT][2][1]/_S_));\n'
            '    for (i=0; i<3; i++) {\n'
            '        axis[i] = matrices[TIP_BASE_ROT_MAT][i][1]/_S_ / axis_length;\n'
            '        start[i] = matrices[TIP_BASE_ROT_MAT][i][2]/_S_;\n'
            '    }\n'
            '    axial = axis[0]*start[0] + axis[1]*start[1] + axis[2]*start[2];\n'
            '    start_length = sqrt(squared(start[0] - axial*axis[0]) +\n'
            '                        squared(start[1] - axial*axis[1]) +\n'
            '                        squared(start[2] - axial*axis[2]));\n'
            '    for (i=0; i<3; i++) {\n'
            '        offset[i] = TR_center[TR_index][i]/_S_ - motion_circle_center[i]/_S_ - (motion_circle_r/_S_)*axial*axis[i];\n'
            '    }\n'
            '    height = offset[0]*axis[0] + offset[1]*axis[1] + offset[2]*axis[2];\n'
            '    across = sqrt(squared(offset[0] - height*axis[0]) +\n'
            '                  squared(offset[1] - height*axis[1]) +\n'
            '                  squared(offset[2] - height*axis[2]));\n'
            '    dist = sqrt(squared(across - start_length*(motion_circle_r/_S_)) + squared(height));\n'
            '    return fint(dist*_S_) - CIRCLE_MARGIN - TR_radius[TR_index]')
        if (model.moving and model.moving.has_targets):
            put(' - target_reach(TR_index)')
        put(' > 0;\n'
            '}\n'
            '\n')
        if model.spins:
            put('// Whether the circle passes by a target region whatever spin the next push has. Its roundings are less than three times those on\n'
                '// a circle.\n'
                'bool all_spins_miss(int TR_index) {\n'
                '    int spin;\n'
                '    double place[3];\n'
                '    double r, off_circle;\n'
                '    double _S_ = _SI_*1.0;\n'
                '\n'
                '    look_at(TR_index, place);\n'
                '    for (spin=0; spin<SPIN_COUNT; spin++) {\n'
                '        r = spin_radii[spin]/_S_;\n'
                '        off_circle = sqrt(place[0]*place[0] + (r + place[2])*(r + place[2])) - r;\n'
                '        if (sqrt(off_circle*off_circle + place[1]*place[1])*_S_ <= TR_radius[TR_index] + 4*CIRCLE_MARGIN) {\n'
                '            return false;\n'
                '        }\n'
                '    }\n'
                '    return true;\n'
                '}\n'
                '\n')
        if model.adversary:
            put('// Whether the tissue may pick a circle that passes by a target region which lies there, in a segment that begins with a roll\n'
                '// by this angle in rad. The roundings of the roll and of the pick are less than three times those on a circle.\n'
                'bool pick_may_miss(int TR_index, double ahead, double aside, double above, double angle) {\n'
                '    int bend, twist;\n'
                '    double turn, in_plane, off_plane, off_circle, r;\n'
                '    double _S_ = _SI_*1.0;\n'
                '\n'
                '    for (twist=0; twist<TWIST_COUNT; twist++) {\n'
                '        turn = angle + roll_errors[twist]/_S_;\n'
                '        in_plane = above * cos(turn) - aside * sin(turn);\n'
                '        off_plane = above * sin(turn) + aside * cos(turn);\n'
                '        for (bend=0; bend<BEND_COUNT; bend++) {\n'
                '            r = circle_radii[bend]/_S_;\n'
                '            off_circle = sqrt(ahead*ahead + (r + in_plane)*(r + in_plane)) - r;\n'
                '            if ((sqrt(off_circle*off_circle + off_plane*off_plane))*_S_ > TR_radius[TR_index] + 4*CIRCLE_MARGIN) {\n'
                '                return true;\n'
                '            }\n'
                '        }\n'
                '    }\n'
                '    return false;\n'
                '}\n'
                '\n'
                "// The same for all angles: the circles that begin there form a horn torus about the tip's direction, one for each bend.\n"
                'bool pick_may_miss_by_any_roll(int TR_index, double ahead, double beside) {\n'
                '    int bend;\n'
                '    double r;\n'
                '    double _S_ = _SI_*1.0;\n'
                '\n'
                '    for (bend=0; bend<BEND_COUNT; bend++) {\n'
                '        r = circle_radii[bend]/_S_;\n'
                '        if (fabs(sqrt(ahead*ahead + (r - beside)*(r - beside)) - r)*_S_ > TR_radius[TR_index] + 4*CIRCLE_MARGIN) {\n'
                '            return true;\n'
                '        }\n'
                '    }\n'
                '    return false;\n'
                '}\n'
                '\n'
                '// Whether the target is lost in a segment before the last roll, whatever regions are in the way: the circle passes by, and\n'
                '// wherever on it the tip is rolled, and by which angle, the tissue may let it pass by.\n'
                'bool is_hopeless(int TR_index) {\n'
                '    int i, pushes;\n'
                '    double place[3];\n'
                '    double turned, along, across, back, up, ahead, above, r, yaw;\n'
                '    double _S_ = _SI_*1.0;\n'
                '\n'
                '    if (ROT_counter != MAX_ROT_COUNT - 1 || !circle_misses(TR_index)) {\n'
                '        return false;\n'
                '    }\n'
                '    look_at(TR_index, place);\n'
                '    r = motion_circle_r/_S_;\n'
                '    yaw = (needle_vel/_S_) * dt / r;\n'
                '    pushes = fint((MAX_PROG - needle_progress)/((needle_vel/_S_) * dt * _S_));\n'
                '    for (turned=0.0; pushes>=0; turned=turned+yaw) {\n'
                '        along = cos(turned);\n'
                '        across = sin(turned);\n'
                '        back = place[0] - r*across;\n'
                '        up = place[2] + r*(1.0 - along);\n'
                '        ahead = back*along - up*across;\n'
                '        above = up*along + back*across;\n'
                '        if (!pick_may_miss_by_any_roll(TR_index, ahead, sqrt(place[1]*place[1] + above*above))) {\n'
                '            for (i=0; i<ANGLE_COUNT; i++) {\n'
                '                if (!pick_may_miss(TR_index, ahead, place[1], above, allowed_rot_angles[i]/180.0 * PI)) {\n'
                '                    return false;\n'
                '                }\n'
                '            }\n'
                '        }\n'
                '        pushes--;\n'
                '    }\n'
                '    return true;\n'
                '}\n'
                '\n')
    put('// Whether a target region is still ahead: the tip has not gone past its lower end. It cannot come back up.')
    if model.only_plans:
        put('\n'
            '// With no roll left, its circle must lead there.')
    put('\n'
        'bool TR_reachable = false;\n'
        'bool check_specific_TR_reachable(int TR_index) {')
    if (model.only_plans and model.adversary):
        put('\n'
            '    double place[3];')
    put('\n'
        '    TR_reachable = (tip_pos[1] >= ')
    if model.solids.targets:
        put('TR_low[TR_index]')
    else:
        put('(TR_center[TR_index][1] - TR_radius[TR_index])')
    if (model.moving and model.moving.has_targets):
        put(' - target_reach(TR_index)')
    put(');')
    if model.only_plans:
        put('\n'
            '    if (!check_rotation_left() && TR_reachable && ')
        if model.spins:
            put('(is_spin_open ? all_spins_miss(TR_index) : circle_misses(TR_index))')
        else:
            put('circle_misses(TR_index)')
        put(') {\n'
            '        TR_reachable = false;\n'
            '    }')
        if model.adversary:
            put('\n'
                '    if (ROT_counter >= MAX_ROT_COUNT && TR_reachable && !is_picked && ROT_counter > 0) {\n'
                '        look_at(TR_index, place);\n'
                '        TR_reachable = !pick_may_miss(TR_index, place[0], place[1], place[2], 0.0);\n'
                '    }\n'
                '    if (is_new_pick) {\n'
                '        is_new_pick = false;\n'
                '        if (TR_reachable && is_hopeless(TR_index)) {\n'
                '            TR_reachable = false;\n'
                '        }\n'
                '    }')
    put('\n'
        '    return TR_reachable;\n'
        '}\n'
        'bool check_TR_reachable() {\n'
        '    return check_specific_TR_reachable(curr_TR_index);\n'
        '}\n'
        '\n'
        '// Whether the tip still travels downwards (or level), and no more is inserted than there is.\n'
        'bool path_valid = false;\n'
        'bool check_path_valid() {\n'
        '    bool is_negative_y_motion = vectors[TIP_X_VEC][1] <= 0;\n'
        '    bool is_needle_long_enough = needle_progress <= MAX_PROG;\n'
        '    path_valid = is_negative_y_motion && is_needle_long_enough;\n'
        '    return path_valid;\n'
        '}\n')
    if model.chance:
        put('\n')
        put('/****************************************** The tissue with chance ******************************************/\n'
            '// Everything above is what is expected: decisions rest on it. The true tip deviates from it by chance. It is kept in doubles,\n'
            '// which random runs know, and which queries without probabilities leave out: nothing that is decided depends on them.\n'
            '//\n'
            '// * A segment is what the tip travels from the entry, or from a roll, to the next roll. In each the needle bends by a factor\n'
            '//   more than expected, and the roll before it turned the tip by an error more. The logarithm of the factor and the error are\n'
            '//   normal, and independent of each other and of other segments.\n'
            '// * At the end of each push the tip lies off its circle by a vector whose coordinates are normal and independent. Between two\n'
            '//   ends of pushes it goes from one to the other in a straight line, and it starts with none.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const double CURVATURE_SPREAD = ', model.chance.curvature_spread, ';',))),))))
        put(' // Of the logarithm of the factor: its standard deviation.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const double ROLL_SPREAD = ', model.chance.roll_spread_rad, ';',))),))))
        put(' // That of the error of a roll, in rad.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const double TIP_SPREAD = ', model.chance.tip_spread_mm, ';',))),))))
        put(' // That of each coordinate of the vector, in mm.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const double CHANCE_RADIUS = ', model.chance.radius_mm, ';',))),))))
        put(' // The radius of the motion circle that is expected, in mm.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const double PUSH_LENGTH = ', model.chance.push_mm, ';',))),))))
        put(' // What a push inserts, in mm.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const int PUSH_PARTS = ', model.chance.parts, ';',))),))))
        put(' // The way of a push is looked at after each of these parts.\n')
        put(shown(('%-53s' % (''.join(map(shown, ('const int DRAWN_COUNT = ', model.chance.segments, ';',))),))))
        put(' // Segments on one path, at most.\n'
            'double drawn_factor[DRAWN_COUNT];                     // What was drawn for each segment: factors of the curvature,\n'
            'double drawn_error[DRAWN_COUNT];                      //   and errors of the roll before it, in rad.\n'
            'bool is_drawn = false;\n'
            'bool is_pushing = false;                              // Whether the action of the moment is a push.\n'
            'int drawn_segment = 0;                                // The segment of the moment: the number of rolls so far.\n'
            'int push_count = 0;                                   // Pushes so far.\n'
            '\n')
        put(shown(('%-53s' % (''.join(map(shown, ('double true_pos[3] = ', model.chance.position, ';',))),))))
        put(' // The true tip on its circle, in mm,\n')
        put(shown(('%-53s' % (''.join(map(shown, ('double true_heading[3] = ', model.chance.heading, ';',))),))))
        put(' //   the direction in which it travels,\n')
        put(shown(('%-53s' % (''.join(map(shown, ('double true_bevel[3] = ', model.chance.bevel, ';',))),))))
        put(' //   and that away from the centre of its circle.\n'
            'double tip_offset[3] = {0.0, 0.0, 0.0};               // How far the tip is off its circle.\n'
            'double true_place[3];                                 // Where it passes, off its circle.\n'
            '// How far the targets are, in mm; negative inside. See tip_miss.\n'
            'double target_away[TR_COUNT] = {')
        put(shown(', '.join(map(shown, model.chance.targets_unseen))))
        put('};\n'
            '\n')
        if model.chance.has_unsafe:
            put("// The least distance of the tip's whole way from critical and unexplored regions, in mm. Not greater than 0: it touched one.\n"
                'double tip_clearance = ')
            put(shown(model.chance.unseen))
            put(';\n')
        put('// By how much the tip misses the targets, in mm. The last one counts at the end of the last push, the others where the way is\n'
            '// nearest to them; the worst of them counts. Not greater than 0: all were reached.\n'
            'double tip_miss = ')
        put(shown(model.chance.unseen))
        put(';\n'
            '\n'
            '// What the tissue does in all segments is drawn at its first reaction. So runs with the same random numbers have the same\n'
            '// tissue, whatever the plan.\n'
            'void draw_tissue() {\n'
            '    int i;\n'
            '    for (i=0; i<DRAWN_COUNT; i++) {\n'
            '        drawn_factor[i] = exp(CURVATURE_SPREAD*random_normal(0.0, 1.0));\n'
            '        drawn_error[i] = ROLL_SPREAD*random_normal(0.0, 1.0);\n'
            '    }\n'
            '    is_drawn = true;\n'
            '}\n'
            '\n'
            '// The distance of a sphere of the tables above from a place.\n'
            'double ball_distance(fixed_t center_x, fixed_t center_y, fixed_t center_z, fixed_t radius, double x, double y, double z) {\n'
            '    double _S_ = _SI_*1.0;\n'
            '    return sqrt(squared(center_x/_S_ - x) + squared(center_y/_S_ - y) + squared(center_z/_S_ - z)) - radius/_S_;\n'
            '}\n'
            '\n'
            '// The distance of a target from a place.\n'
            'double target_distance(int TR_index, double x, double y, double z) {')
        for is_last_1, (kind, form) in with_last(model.chance.target_forms):
            put('\n'
                '    if (TR_form[TR_index] == ')
            put(shown(form))
            put(') {\n'
                '        return ')
            put(shown(kind))
            put('_distance(TR_place[TR_index], x, y, z);\n'
                '    }')
        put('\n'
            '    return ball_distance(TR_center[TR_index][0], TR_center[TR_index][1], TR_center[TR_index][2], TR_radius[TR_index], x, y, z);\n'
            '}\n'
            '\n'
            '// The tip passes true_place.\n'
            'void pass_place() {\n'
            '    int i;')
        if model.criticals.count:
            put('\n'
                '    for (i=0; i<CR_COUNT; i++) {\n'
                '        tip_clearance = fmin(tip_clearance, ball_distance(CR_center[i][0], CR_center[i][1], CR_center[i][2], CR_radius[i],\n'
                '                                                          true_place[0], true_place[1], true_place[2]));\n'
                '    }')
        if model.unexplored.count:
            put('\n'
                '    for (i=0; i<UR_COUNT; i++) {\n'
                '        tip_clearance = fmin(tip_clearance, ball_distance(UR_center[i][0], UR_center[i][1], UR_center[i][2], UR_radius[i],\n'
                '                                                          true_place[0], true_place[1], true_place[2]));\n'
                '    }')
        for is_last_1, (kind, first, last) in with_last(model.chance.unsafe_solids):
            put('\n'
                '    for (i=')
            put(shown(first))
            put('; i<=')
            put(shown(last))
            put('; i++) {\n'
                '        tip_clearance = fmin(tip_clearance, ')
            put(shown(kind))
            put('_distance(i, true_place[0], true_place[1], true_place[2]));\n'
                '    }')
        put('\n'
            '    for (i=0; i<TR_COUNT-1; i++) {\n'
            '        target_away[i] = fmin(target_away[i], target_distance(i, true_place[0], true_place[1], true_place[2]));\n'
            '    }\n'
            '}\n'
            '\n'
            '// A push, as the tissue lets the needle go: on a circle of its own, about the same axis.\n'
            'void push_truly() {\n'
            '    double from_offset[3], heading[3], bevel[3];\n'
            '    double radius, turn, part;\n'
            '    int i, k;\n'
            '\n'
            '    radius = CHANCE_RADIUS / drawn_factor[drawn_segment];\n'
            '    for (i=0; i<3; i++) {\n'
            '        from_offset[i] = tip_offset[i];\n'
            '        tip_offset[i] = TIP_SPREAD*random_normal(0.0, 1.0);\n'
            '        heading[i] = true_heading[i];\n'
            '        bevel[i] = true_bevel[i];\n'
            '    }\n'
            '    for (k=push_count == 0 ? 0 : 1; k<=PUSH_PARTS; k++) {\n'
            '        part = k*1.0/PUSH_PARTS;\n'
            '        turn = part*PUSH_LENGTH/radius;\n'
            '        for (i=0; i<3; i++) {\n'
            '            true_place[i] = true_pos[i] + radius*(sin(turn)*heading[i] - (1.0 - cos(turn))*bevel[i]) +\n'
            '                            (1.0 - part)*from_offset[i] + part*tip_offset[i];\n'
            '        }\n'
            '        pass_place();\n'
            '    }\n'
            '    turn = PUSH_LENGTH/radius;\n'
            '    for (i=0; i<3; i++) {\n'
            '        true_pos[i] = true_place[i] - tip_offset[i];\n'
            '        true_heading[i] = cos(turn)*heading[i] - sin(turn)*bevel[i];\n'
            '        true_bevel[i] = cos(turn)*bevel[i] + sin(turn)*heading[i];\n'
            '    }\n'
            '    target_away[TR_COUNT-1] = target_distance(TR_COUNT-1, true_place[0], true_place[1], true_place[2]);\n'
            '    tip_miss = target_away[0];\n'
            '    for (i=1; i<TR_COUNT; i++) {\n'
            '        tip_miss = fmax(tip_miss, target_away[i]);\n'
            '    }\n'
            '    push_count++;\n'
            '}\n'
            '\n'
            '// A roll by an angle in rad, and its error.')
        if model.free_bevel:
            put(' Before the entry the bevel is seen, and a roll does not err.')
        put('\n'
            'void roll_truly(double angle) {\n'
            '    double aside[3];\n'
            '    double turn;\n'
            '    int i;\n'
            '\n'
            '    drawn_segment++;\n'
            '    turn = angle + ')
        if model.free_bevel:
            put('(push_count == 0 ? 0.0 : 1.0)*')
        put('drawn_error[drawn_segment];\n'
            '    aside[0] = true_heading[1]*true_bevel[2] - true_heading[2]*true_bevel[1];\n'
            '    aside[1] = true_heading[2]*true_bevel[0] - true_heading[0]*true_bevel[2];\n'
            '    aside[2] = true_heading[0]*true_bevel[1] - true_heading[1]*true_bevel[0];\n'
            '    for (i=0; i<3; i++) {\n'
            '        true_bevel[i] = cos(turn)*true_bevel[i] + sin(turn)*aside[i];\n'
            '    }\n'
            '}\n'
            '\n'
            '// What the Tissue does after each action.\n'
            'void react() {\n'
            '    if (!is_drawn) {\n'
            '        draw_tissue();\n'
            '    }\n'
            '    if (is_pushing) {\n'
            '        push_truly();\n'
            '    } else {\n'
            '        roll_truly(sel_rot_angle/180.0 * PI);\n'
            '    }\n'
            '    is_pushing = false;\n'
            '}')
        if model.chance.plan:
            put('\n'
                '\n'
                '/** The plan: what is done, one action after the other **/\n'
                'const int ACTION_COUNT = ')
            put(shown(len(model.chance.plan)))
            put(';\n'
                'const int PLAN[ACTION_COUNT] = {')
            put(shown(', '.join(map(shown, model.chance.plan))))
            put('};     // 0: a push; else: a roll, in degrees.\n'
                'int next_action = 0;')
        put('\n')
    return "".join(out)


def document(model: Any, declaration: Any, queries: Any) -> str:
    out = []
    put = out.append
    put('<?xml version="1.0" encoding="utf-8"?>\n'
        "<!DOCTYPE nta PUBLIC '-//Uppaal Team//DTD Flat System 1.1//EN' 'http://www.it.uu.se/research/group/darts/uppaal/flat-1_2.dtd'>\n"
        '<nta>\n'
        '<declaration>')
    put(escaped(declaration))
    put('</declaration>\n')
    def location(id, name, at, name_at, invariant=None, committed=False, color=None, urgent=False):
        out = []
        put = out.append
        put('\n'
            '\t<location id="')
        put(escaped(id))
        put('" x="')
        put(escaped(at[0]))
        put('" y="')
        put(escaped(at[1]))
        put('"')
        if color:
            put(' color="')
            put(escaped(color))
            put('"')
        put('>\n'
            '\t\t<name x="')
        put(escaped(name_at[0]))
        put('" y="')
        put(escaped(name_at[1]))
        put('">')
        put(escaped(name))
        put('</name>')
        if invariant:
            put('\n'
                '\t\t<label kind="invariant" x="')
            put(escaped(invariant[1]))
            put('" y="')
            put(escaped(invariant[2]))
            put('">')
            put(escaped(invariant[0]))
            put('</label>')
        if committed:
            put('\n'
                '\t\t<committed/>')
        if urgent:
            put('\n'
                '\t\t<urgent/>')
        put('\n'
            '\t</location>')
        return Safe("".join(out))
    def transition(source, target, labels, nails=[], controllable=True):
        out = []
        put = out.append
        put('\n'
            '\t<transition')
        if (not controllable):
            put(' controllable="false"')
        put('>\n'
            '\t\t<source ref="')
        put(escaped(source))
        put('"/>\n'
            '\t\t<target ref="')
        put(escaped(target))
        put('"/>')
        for is_last_1, (kind, x, y, text) in with_last(labels):
            put('\n'
                '\t\t<label kind="')
            put(escaped(kind))
            put('" x="')
            put(escaped(x))
            put('" y="')
            put(escaped(y))
            put('">')
            put(escaped(text))
            put('</label>')
        for is_last_1, (x, y) in with_last(nails):
            put('\n'
                '\t\t<nail x="')
            put(escaped(x))
            put('" y="')
            put(escaped(y))
            put('"/>')
        put('\n'
            '\t</transition>')
        return Safe("".join(out))
    put('<template>\n'
        '\t<name>User</name>\n'
        '\t<declaration>// The decision maker. Its choice in Idle (push, or roll by which angle) is what a strategy decides.</declaration>')
    put(escaped(location('user_init', 'Init', (0, 0, ), ((-16), (-40), ), committed=True)))
    put(escaped(location('user_wait_for_check', 'Wait_For_Check', (272, 0, ), (214, (-40), ))))
    put(escaped(location('user_idle', 'Idle', (544, 0, ), (528, (-40), ), color='#a0d0ff', urgent=((not (model.moving is None)) or (not (model.chance is None))))))
    put(escaped(location('user_perform_action', 'Perform_Action', (544, 204, ), (568, 208, ))))
    put(escaped(location('user_request_check', 'Request_Check', (544, 340, ), (564, 344, ), committed=True)))
    put(escaped(location('user_end', 'End', (272, 136, ), (260, 152, ))))
    put('\n'
        '\t<init ref="user_init"/>')
    put(escaped(transition('user_init', 'user_wait_for_check', [('synchronisation', 76, (-38), 'do_check!', ), ('assignment', 76, (-21), 'initialize()', ), ])))
    put(escaped(transition('user_wait_for_check', 'user_end', [('synchronisation', 284, 60, 'terminate?', ), ])))
    put(escaped(transition('user_wait_for_check', 'user_idle', [('synchronisation', 344, (-21), 'finished_check?', ), ])))
    put(escaped(transition('user_idle', 'user_perform_action', (((([('select', 260, 60, 'spin_index : int[0, SPIN_COUNT - 1]', ), ('guard', 260, 77, 'check_spin_allowed(spin_index)', ), ] if model.spins else []) + ([('guard', 400, 77, 'check_push_allowed()', ), ] if model.moving else [])) + [('synchronisation', 400, 94, 'do_push!', ), ]) + ([('assignment', 260, 111, 'choose_spin(spin_index)', ), ] if model.spins else [])), nails=[(476, 68, ), (476, 136, ), ])))
    put(escaped(transition('user_idle', 'user_perform_action', [('select', 624, 68, 'angle_index : int[0, ANGLE_COUNT - 1]', ), ('guard', 624, 85, ''.join(map(shown, ('check_rotation_allowed()', (' && check_angle_allowed(allowed_rot_angles[angle_index])' if model.spins else ''),))), ), ('synchronisation', 624, 102, 'do_rotate!', ), ('assignment', 624, 119, 'sel_rot_angle = allowed_rot_angles[angle_index]', ), ], nails=[(612, 68, ), (612, 136, ), ])))
    if model.moving:
        put(escaped(transition('user_idle', 'user_perform_action', [('guard', 552, 150, 'check_wait_allowed()', ), ('synchronisation', 552, 167, 'do_wait!', ), ('assignment', 552, 184, 'begin_wait()', ), ])))
    put(escaped(transition('user_perform_action', 'user_request_check', [('synchronisation', 556, 265, 'finished_tissue_action?', ), ])))
    put(escaped(transition('user_request_check', 'user_wait_for_check', [('synchronisation', 300, 319, 'do_check!', ), ], nails=[(136, 340, ), (136, 68, ), ])))
    put('\n'
        '</template>\n')
    put('\n')
    push = ('PUSH_TIME' if model.moving else 'dt')
    put('<template>\n'
        '\t<name>Needle</name>\n'
        '\t<declaration>// The controlled device. A push takes ')
    put(escaped(push))
    put(', a roll takes no time.\n'
        'clock ti;   // Time since the push ')
    put(escaped(('or the wait ' if model.moving else '')))
    put('began.</declaration>')
    put(escaped(location('needle_idle', 'Idle', (0, 0, ), ((-16), (-44), ))))
    put(escaped(location('needle_push', 'Push', ((-340), 0, ), ((-400), (-24), ), invariant=(''.join(map(shown, ('ti <= ', push,))), (-432), 8, ), color='#a0d0ff')))
    if model.moving:
        put(escaped(location('needle_wait', 'Wait', (0, 300, ), ((-16), 316, ), invariant=('ti <= WAIT_TIME', (-48), 333, ), color='#a0d0ff')))
    put(escaped(location('needle_rotate', 'Rotate', (340, 0, ), (360, (-8), ), committed=True)))
    put('\n'
        '\t<init ref="needle_idle"/>')
    put(escaped(transition('needle_idle', 'needle_push', [('guard', (-240), (-125), ''.join(map(shown, (push, ' >= 0',))), ), ('synchronisation', (-240), (-108), 'do_push?', ), ('assignment', (-240), (-91), 'ti = 0', ), ], nails=[((-85), (-68), ), ((-255), (-68), ), ])))
    put(escaped(transition('needle_push', 'needle_idle', [('guard', (-240), 75, ''.join(map(shown, ('ti >= ', push,))), ), ('synchronisation', (-240), 92, 'do_tissue_action!', ), ('assignment', (-240), 109, ('is_pushing = true' if model.adversary else ''.join(map(shown, ('step()', (',\nend_push()' if model.moving else ''), (',\nis_pushing = true' if model.chance else ''),)))), ), ], nails=[((-255), 68, ), ((-85), 68, ), ])))
    if model.moving:
        put(escaped(transition('needle_idle', 'needle_wait', [('guard', (-160), 150, 'WAIT_TIME >= 0', ), ('synchronisation', (-160), 167, 'do_wait?', ), ('assignment', (-160), 184, 'ti = 0', ), ], nails=[((-34), 85, ), ((-34), 255, ), ])))
        put(escaped(transition('needle_wait', 'needle_idle', [('guard', 46, 150, 'ti >= WAIT_TIME', ), ('synchronisation', 46, 167, 'do_tissue_action!', ), ('assignment', 46, 184, 'end_wait()', ), ], nails=[(34, 255, ), (34, 85, ), ])))
    put(escaped(transition('needle_idle', 'needle_rotate', [('synchronisation', 95, (-125), 'do_rotate?', ), ('assignment', 95, (-108), 'log_push_action(),\nlog_rotation_action()', ), ], nails=[(85, (-68), ), (255, (-68), ), ])))
    put(escaped(transition('needle_rotate', 'needle_idle', [('synchronisation', 95, 75, 'do_tissue_action!', ), ('assignment', 95, 92, ''.join(map(shown, (('begin_segment(),\n' if (model.adversary or model.spins) else ''), 'rotate_deg(sel_rot_angle)', (',\nend_roll()' if model.moving else ''),))), ), ], nails=[(255, 68, ), (85, 68, ), ])))
    put('\n'
        '</template>\n')
    put('\n')
    put('<template>\n'
        '\t<name>Tissue</name>')
    if model.adversary:
        put('\n'
            '\t<declaration>// The environment, the opponent in the game: it picks how the needle bends, and the error of each roll.</declaration>')
    elif model.chance:
        put('\n'
            '\t<declaration>// The environment, the opponent in the game. Its answer moves the true tip, which decisions do not see.</declaration>')
    else:
        put('\n'
            '\t<declaration>// The environment, the opponent in the game. Static tissue: the answer changes nothing.</declaration>')
    put(escaped(location('tissue_idle', 'Idle', (0, 0, ), ((-48), (-8), ))))
    put(escaped(location('tissue_react', 'React', (306, 0, ), (326, (-8), ), committed=True, color='#ffc080')))
    put('\n'
        '\t<init ref="tissue_idle"/>')
    put(escaped(transition('tissue_idle', 'tissue_react', [('synchronisation', 85, (-89), 'do_tissue_action?', ), ], nails=[(68, (-68), ), (238, (-68), ), ])))
    if model.adversary:
        put(escaped(transition('tissue_react', 'tissue_idle', [('guard', 68, 58, '!is_pushing', ), ('synchronisation', 68, 75, 'finished_tissue_action!', ), ], nails=[(238, 68, ), (68, 68, ), ], controllable=False)))
        put(escaped(transition('tissue_react', 'tissue_idle', [('guard', 68, 143, 'is_pushing && is_picked', ), ('synchronisation', 68, 160, 'finished_tissue_action!', ), ('assignment', 68, 177, 'step()', ), ], nails=[(238, 153, ), (68, 153, ), ], controllable=False)))
        put(escaped(transition('tissue_react', 'tissue_idle', [('select', 68, 228, 'bend : int[0, BEND_COUNT - 1], twist : int[0, TWIST_COUNT - 1]', ), ('guard', 68, 245, 'is_pushing && !is_picked && (ROT_counter > 0 || twist == NOMINAL_TWIST)', ), ('synchronisation', 68, 262, 'finished_tissue_action!', ), ('assignment', 68, 279, 'pick(bend, twist),\nstep()', ), ], nails=[(238, 238, ), (68, 238, ), ], controllable=False)))
    elif model.chance:
        put(escaped(transition('tissue_react', 'tissue_idle', [('synchronisation', 68, 75, 'finished_tissue_action!', ), ('assignment', 68, 92, 'react()', ), ], nails=[(238, 68, ), (68, 68, ), ], controllable=False)))
    else:
        put(escaped(transition('tissue_react', 'tissue_idle', [('synchronisation', 68, 75, 'finished_tissue_action!', ), ], nails=[(238, 68, ), (68, 68, ), ], controllable=False)))
    put('\n'
        '</template>\n')
    put('\n')
    unharmed = (' && !CR_reached &&\n' if model.swept else ' && ')
    put('<template>\n'
        '\t<name>Checker</name>\n'
        '\t<declaration>// The state checker. Its four dead ends classify a path; UR_Reached means: an unsafe (critical) region was reached.</declaration>')
    put(escaped(location('checker_idle', 'Idle', (0, 0, ), ((-16), (-36), ))))
    put(escaped(location('checker_path_valid', 'Check_Path_Valid', (0, 136, ), ((-156), 119, ), committed=True)))
    put(escaped(location('checker_tr_reached', 'Check_TR_Reached', (0, 272, ), ((-156), 246, ), committed=True)))
    put(escaped(location('checker_tr_reachable', 'Check_TR_Reachable', (0, 408, ), ((-172), 412, ), committed=True)))
    put(escaped(location('checker_cr_reached', 'Check_CR_Reached', (0, 544, ), ((-148), 556, ), committed=True)))
    put(escaped(location('checker_path_invalid', 'Path_Invalid', (560, 136, ), (580, 128, ), color='#c0c0c0')))
    put(escaped(location('checker_final_tr_reached', 'Final_TR_Reached', (560, 272, ), (580, 264, ), color='#90d090')))
    put(escaped(location('checker_tr_unreachable', 'TR_Unreachable', (560, 408, ), (580, 400, ), color='#c0c0c0')))
    put(escaped(location('checker_ur_reached', 'UR_Reached', (560, 544, ), (580, 536, ), color='#e08080')))
    put('\n'
        '\t<init ref="checker_idle"/>')
    put(escaped(transition('checker_idle', 'checker_path_valid', [('synchronisation', 12, 51, 'do_check?', ), ('assignment', 12, 68, 'check_path_valid()', ), ])))
    put(escaped(transition('checker_path_valid', 'checker_path_invalid', [('guard', 187, 98, '!path_valid', ), ('synchronisation', 187, 115, 'terminate!', ), ])))
    put(escaped(transition('checker_path_valid', 'checker_tr_reached', [('guard', 12, 170, 'path_valid', ), ('assignment', 12, 187, ''.join(map(shown, ('check_TR_reached()', (',\ncheck_CR_reached()' if model.swept else ''),))), ), ])))
    put(escaped(transition('checker_tr_reached', 'checker_final_tr_reached', [('guard', 187, 196, ''.join(map(shown, ('TR_reached', unharmed, 'curr_TR_index == TR_COUNT - 1',))), ), ('synchronisation', 187, 232, 'terminate!', ), ('assignment', 187, 249, 'curr_TR_index++', ), ])))
    put(escaped(transition('checker_tr_reached', 'checker_tr_reachable', [('guard', (-428), 290, ''.join(map(shown, ('TR_reached', unharmed, 'curr_TR_index < TR_COUNT - 1',))), ), ('assignment', (-428), 326, 'curr_TR_index++,\ncheck_TR_reachable()', ), ], nails=[((-68), 306, ), ((-68), 374, ), ])))
    if model.swept:
        put(escaped(transition('checker_tr_reached', 'checker_ur_reached', [('guard', 250, 330, 'TR_reached && CR_reached', ), ('synchronisation', 250, 347, 'terminate!', ), ], nails=[(238, 323, ), (238, 510, ), ])))
    put(escaped(transition('checker_tr_reached', 'checker_tr_reachable', [('guard', 12, 311, '!TR_reached', ), ('assignment', 12, 328, 'check_TR_reachable()', ), ])))
    put(escaped(transition('checker_tr_reachable', 'checker_tr_unreachable', [('guard', 306, 370, '!TR_reachable', ), ('synchronisation', 306, 387, 'terminate!', ), ])))
    put(escaped(transition('checker_tr_reachable', 'checker_cr_reached', ([('guard', 12, 442, 'TR_reachable', ), ] + ([] if model.swept else [('assignment', 12, 459, 'check_CR_reached()', ), ])))))
    put(escaped(transition('checker_cr_reached', 'checker_ur_reached', [('guard', 187, 552, 'CR_reached', ), ('synchronisation', 187, 569, 'terminate!', ), ])))
    put(escaped(transition('checker_cr_reached', 'checker_idle', [('guard', (-340), 506, '!CR_reached', ), ('synchronisation', (-340), 523, 'finished_check!', ), ], nails=[((-476), 544, ), ((-476), 0, ), ])))
    put('\n'
        '</template>\n')
    put('\n'
        "<system>// One process of each template, under the template's own name.\n"
        'system User, Needle, Tissue, Checker;</system>\n'
        '<queries>')
    for is_last_1, query in with_last(queries):
        put('\n'
            '\t<query>\n'
            '\t\t<formula>')
        put(escaped(query.formula))
        put('</formula>\n'
            '\t\t<comment>')
        put(escaped(query.comment))
        put('</comment>\n'
            '\t</query>')
    put('\n'
        '</queries>\n'
        '</nta>\n')
    return "".join(out)


def plan_document(model: Any, declaration: Any, queries: Any) -> str:
    out = []
    put = out.append
    put('<?xml version="1.0" encoding="utf-8"?>\n'
        "<!DOCTYPE nta PUBLIC '-//Uppaal Team//DTD Flat System 1.1//EN' 'http://www.it.uu.se/research/group/darts/uppaal/flat-1_2.dtd'>")
    def location(id, name, at, name_at, invariant=None, committed=False, color=None, urgent=False):
        out = []
        put = out.append
        put('\n'
            '\t<location id="')
        put(escaped(id))
        put('" x="')
        put(escaped(at[0]))
        put('" y="')
        put(escaped(at[1]))
        put('"')
        if color:
            put(' color="')
            put(escaped(color))
            put('"')
        put('>\n'
            '\t\t<name x="')
        put(escaped(name_at[0]))
        put('" y="')
        put(escaped(name_at[1]))
        put('">')
        put(escaped(name))
        put('</name>')
        if invariant:
            put('\n'
                '\t\t<label kind="invariant" x="')
            put(escaped(invariant[1]))
            put('" y="')
            put(escaped(invariant[2]))
            put('">')
            put(escaped(invariant[0]))
            put('</label>')
        if committed:
            put('\n'
                '\t\t<committed/>')
        if urgent:
            put('\n'
                '\t\t<urgent/>')
        put('\n'
            '\t</location>')
        return Safe("".join(out))
    def transition(source, target, labels, nails=[], controllable=True):
        out = []
        put = out.append
        put('\n'
            '\t<transition')
        if (not controllable):
            put(' controllable="false"')
        put('>\n'
            '\t\t<source ref="')
        put(escaped(source))
        put('"/>\n'
            '\t\t<target ref="')
        put(escaped(target))
        put('"/>')
        for is_last_1, (kind, x, y, text) in with_last(labels):
            put('\n'
                '\t\t<label kind="')
            put(escaped(kind))
            put('" x="')
            put(escaped(x))
            put('" y="')
            put(escaped(y))
            put('">')
            put(escaped(text))
            put('</label>')
        for is_last_1, (x, y) in with_last(nails):
            put('\n'
                '\t\t<nail x="')
            put(escaped(x))
            put('" y="')
            put(escaped(y))
            put('"/>')
        put('\n'
            '\t</transition>')
        return Safe("".join(out))
    put('\n'
        '<nta>\n'
        '<declaration>')
    put(escaped(declaration))
    put('</declaration>\n'
        '<template>\n'
        '\t<name>Insertion</name>\n'
        '\t<declaration>// The needle that follows the plan. A push takes dt, a roll takes no time.\n'
        'clock ti;   // Time since the push began.</declaration>')
    put(escaped(location('insertion_next', 'Next', (0, 0, ), ((-16), (-44), ), committed=True)))
    put(escaped(location('insertion_push', 'Push', ((-340), 0, ), ((-400), (-24), ), invariant=('ti <= dt', (-432), 8, ), color='#a0d0ff')))
    put(escaped(location('insertion_done', 'Done', (340, 0, ), (360, (-8), ), color='#90d090')))
    put('\n'
        '\t<init ref="insertion_next"/>')
    put(escaped(transition('insertion_next', 'insertion_push', [('guard', (-240), (-125), 'next_action < ACTION_COUNT && PLAN[next_action] == 0', ), ('assignment', (-240), (-108), 'ti = 0,\nis_pushing = true', ), ], nails=[((-85), (-68), ), ((-255), (-68), ), ])))
    put(escaped(transition('insertion_push', 'insertion_next', [('guard', (-240), 75, 'ti >= dt', ), ('assignment', (-240), 92, 'react(),\nnext_action++', ), ], nails=[((-255), 68, ), ((-85), 68, ), ], controllable=False)))
    put(escaped(transition('insertion_next', 'insertion_next', [('guard', 34, 119, 'next_action < ACTION_COUNT && PLAN[next_action] != 0', ), ('assignment', 34, 136, 'sel_rot_angle = PLAN[next_action],\nreact(),\nnext_action++', ), ], nails=[((-34), 119, ), (34, 119, ), ], controllable=False)))
    put(escaped(transition('insertion_next', 'insertion_done', [('guard', 85, (-25), 'next_action >= ACTION_COUNT', ), ])))
    put('\n'
        '</template>\n'
        '<system>system Insertion;</system>\n'
        '<queries>')
    for is_last_1, query in with_last(queries):
        put('\n'
            '\t<query>\n'
            '\t\t<formula>')
        put(escaped(query.formula))
        put('</formula>\n'
            '\t\t<comment>')
        put(escaped(query.comment))
        put('</comment>\n'
            '\t</query>')
    put('\n'
        '</queries>\n'
        '</nta>\n')
    return "".join(out)
