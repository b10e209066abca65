/* ACQUIRE as a careful engineer writes it from the table: nested switches, each line reached in one way. It refuses the same
   inputs, watches the same assumptions, acts alike and leaves the same trace as the generated step, with which it is compared in
   instructions and bytes: every state that one leaves is the other's, byte for byte. */
#include "task.h"

int32_t switch_acquire_step(task_t *s);

static int32_t refused(const task_t *s)
{
    if (s->workstation.input_command > VOCABULARY_TASK_COMMAND_CLEAR) {
        return TASK_LEAF_WORKSTATION_INPUT_COMMAND;
    }
    if (s->workstation.obj > VOCABULARY_OBJECT_OPEN_GRIP) {
        return TASK_LEAF_WORKSTATION_OBJ;
    }
    if (s->workstation.grasp > 9u) {
        return TASK_LEAF_WORKSTATION_GRASP;
    }
    if (s->workstation.sector > 99u) {
        return TASK_LEAF_WORKSTATION_SECTOR;
    }
    if (s->from_emove.ref_command_echo > VCBLRY_EMOVE_CMND_RELEASE) {
        return TASK_LEAF_FROM_EMOVE_REF_COMMAND_ECHO;
    }
    if (s->from_emove.status_report > VOCABULARY_LEVEL_STATUS_FAILED) {
        return TASK_LEAF_FROM_EMOVE_STATUS_REPORT;
    }
    if (s->from_emove.failure > VOCABULARY_REASON_NO_PICTURE) {
        return TASK_LEAF_FROM_EMOVE_FAILURE;
    }
    return -1;
}

static void monitor(task_t *s)
{
    bool in_step = s->new_command;
    if (!in_step) {
        switch (s->cur_state) {
        case TASK_COMMON_TASK_STATE_D_STATE:
        case TASK_COMMON_TASK_STATE_F_STATE:
            in_step = s->emove.command == VCBLRY_EMOVE_CMND_PAUSE;
            break;
        case TASK_COMMON_TASK_STATE_STATE_2:
            in_step = s->emove.command == VCBLRY_EMOVE_CMND_MOVE_TO;
            break;
        case TASK_COMMON_TASK_STATE_STATE_3:
            in_step = s->emove.command == VCBLRY_EMOVE_CMND_LOCATE;
            break;
        case TASK_COMMON_TASK_STATE_STATE_4:
            in_step = s->emove.command == VCBLRY_EMOVE_CMND_MOVE_TO_OBJ;
            break;
        case TASK_COMMON_TASK_STATE_STATE_5:
            in_step = s->emove.command == VCBLRY_EMOVE_CMND_PICKUP;
            break;
        default:
            break;
        }
    }
    if (!in_step) {
        s->assumptions_failed |= 1u << TASK_ASSUMPTION_ACQUIRE_IN_STEP;
    }
    if (s->emove.resting && ((s->emove.command != VCBLRY_EMOVE_CMND_PAUSE) ||
            (s->emove.status != VOCABULARY_LEVEL_STATUS_DONE))) {
        s->assumptions_failed |= 1u << TASK_ASSUMPTION_ACQUIRE_RESTING;
    }
}

static void rest(task_t *s, uint8_t status)
{
    s->to_emove.input_command = VCBLRY_EMOVE_CMND_PAUSE;
    s->to_workstation.status_report = status;
}

static void fail(task_t *s, uint8_t reason)
{
    s->to_workstation.failure = reason;
    s->cur_state_next = TASK_COMMON_TASK_STATE_F_STATE;
    s->to_workstation.status_report = VOCABULARY_LEVEL_STATUS_FAILED;
}

static void order(task_t *s, uint8_t command, uint8_t next)
{
    s->to_emove.input_command = command;
    s->cur_state_next = next;
    s->to_workstation.status_report = VOCABULARY_LEVEL_STATUS_EXECUTING;
}

static void nothing_gripped(task_t *s)
{
    s->obj_acquired = false;
    s->obj_now_in_gripper = VOCABULARY_OBJECT_NULL_OBJ;
    s->to_emove.gripped_obj_ptr = VOCABULARY_OBJECT_NULL_OBJ;
}

static void aim(task_t *s, uint8_t where)
{
    s->to_emove.obj_ptr = s->workstation.obj;
    s->to_emove.grasp = s->workstation.grasp;
    s->to_emove.locpt_ptr = where;
    s->to_emove.sector = s->source_sector;
    s->remember_current_loc = s->source_loc;
    s->current_loc = 0u;
}

static uint8_t *buffer_of(task_t *s)
{
    switch (s->workstation.obj) {
    case VOCABULARY_OBJECT_TBOX:
        return &s->tbuffer_boxt;
    case VOCABULARY_OBJECT_BBOX:
        return &s->bbuffer_boxb;
    case VOCABULARY_OBJECT_FLAG:
        return &s->fbuffer_flag;
    case VOCABULARY_OBJECT_HOUS:
        return &s->hbuffer_hous;
    default:
        return 0;
    }
}

static void pick_up(task_t *s)
{
    order(s, VCBLRY_EMOVE_CMND_PICKUP, TASK_COMMON_TASK_STATE_STATE_5);
    s->to_emove.obj_ptr = s->workstation.obj;
    s->obj_acquired = true;
    s->obj_now_in_gripper = s->workstation.obj;
    s->grasp_now = s->workstation.grasp;
    s->to_emove.gripped_obj_ptr = s->workstation.obj;
    s->current_loc = s->source_loc;
    s->current_sector = s->source_sector;
    if (s->source_buffer && (s->last_emove.input_command != VCBLRY_EMOVE_CMND_PICKUP)) {
        uint8_t *count = buffer_of(s);
        if (count != 0) {
            if (*count > 0u) {
                *count = (uint8_t)(*count - 1u);
            } else {
                s->to_workstation.failure = VOCABULARY_REASON_BUF;
                nothing_gripped(s);
                s->to_emove.input_command = VCBLRY_EMOVE_CMND_PAUSE;
                s->cur_state_next = TASK_COMMON_TASK_STATE_F_STATE;
            }
        }
    }
}

static void pick_failed(task_t *s)
{
    if (s->source_buffer && (s->last_emove.input_command == VCBLRY_EMOVE_CMND_PICKUP)) {
        uint8_t *count = buffer_of(s);
        if ((count != 0) && (*count < 99u)) {
            *count = (uint8_t)(*count + 1u);
        }
    }
    nothing_gripped(s);
    if (s->emove.failure == VOCABULARY_REASON_WRONG_SIZE) {
        s->obj_acquired = true;
        s->obj_now_in_gripper = VOCABULARY_OBJECT_UNKNOWN_OBJECT;
        s->to_emove.gripped_obj_ptr = VOCABULARY_OBJECT_UNKNOWN_OBJECT;
    }
}

static int32_t begin_command(task_t *s)
{
    if (!s->emove.resting) {
        s->settling = true;
        rest(s, VOCABULARY_LEVEL_STATUS_EXECUTING);
        return TASK_LINE_ACQUIRE_0;
    }
    if ((s->emove.command != VCBLRY_EMOVE_CMND_PAUSE) || (s->emove.status != VOCABULARY_LEVEL_STATUS_DONE)) {
        fail(s, VOCABULARY_REASON_STATE);
        s->to_emove.input_command = VCBLRY_EMOVE_CMND_PAUSE;
        return TASK_LINE_ACQUIRE_16;
    }
    if (s->obj_acquired) {
        fail(s, VOCABULARY_REASON_CMD);
        return TASK_LINE_ACQUIRE_2;
    }
    if (!s->source_spec) {
        fail(s, VOCABULARY_REASON_CMD);
        return TASK_LINE_ACQUIRE_3;
    }
    if (s->loc_of_obj == TASK_COMMON_LOCATING_VIS_REQD) {
        aim(s, s->source_vupos);
        s->to_emove.apoint_pos_flag = false;
        order(s, VCBLRY_EMOVE_CMND_MOVE_TO, TASK_COMMON_TASK_STATE_STATE_2);
        return TASK_LINE_ACQUIRE_4;
    }
    aim(s, s->source_loc);
    order(s, VCBLRY_EMOVE_CMND_MOVE_TO_OBJ, TASK_COMMON_TASK_STATE_STATE_4);
    return TASK_LINE_ACQUIRE_1;
}

static int32_t emove_done(task_t *s)
{
    switch (s->cur_state) {
    case TASK_COMMON_TASK_STATE_D_STATE:
        if (s->emove.command == VCBLRY_EMOVE_CMND_PAUSE) {
            rest(s, VOCABULARY_LEVEL_STATUS_DONE);
            return TASK_LINE_ACQUIRE_9;
        }
        break;
    case TASK_COMMON_TASK_STATE_STATE_2:
        if (s->emove.command == VCBLRY_EMOVE_CMND_MOVE_TO) {
            s->to_emove.obj_ptr = s->workstation.obj;
            s->to_emove.locpt_ptr = s->source_loc;
            order(s, VCBLRY_EMOVE_CMND_LOCATE, TASK_COMMON_TASK_STATE_STATE_3);
            return TASK_LINE_ACQUIRE_6;
        }
        break;
    case TASK_COMMON_TASK_STATE_STATE_3:
        if (s->emove.command == VCBLRY_EMOVE_CMND_LOCATE) {
            pick_up(s);
            return TASK_LINE_ACQUIRE_7;
        }
        break;
    case TASK_COMMON_TASK_STATE_STATE_4:
        if (s->emove.command == VCBLRY_EMOVE_CMND_MOVE_TO_OBJ) {
            pick_up(s);
            return TASK_LINE_ACQUIRE_5;
        }
        break;
    case TASK_COMMON_TASK_STATE_STATE_5:
        if (s->emove.command == VCBLRY_EMOVE_CMND_PICKUP) {
            s->cur_state_next = TASK_COMMON_TASK_STATE_D_STATE;
            rest(s, VOCABULARY_LEVEL_STATUS_DONE);
            return TASK_LINE_ACQUIRE_8;
        }
        break;
    default:
        break;
    }
    return TASK_LINE_ACQUIRE_16;
}

static int32_t emove_executing(task_t *s)
{
    switch (s->cur_state) {
    case TASK_COMMON_TASK_STATE_STATE_2:
    case TASK_COMMON_TASK_STATE_STATE_3:
    case TASK_COMMON_TASK_STATE_STATE_4:
    case TASK_COMMON_TASK_STATE_STATE_5:
        s->to_workstation.status_report = VOCABULARY_LEVEL_STATUS_EXECUTING;
        return TASK_LINE_ACQUIRE_15;
    case TASK_COMMON_TASK_STATE_D_STATE:
        if (s->emove.command == VCBLRY_EMOVE_CMND_PAUSE) {
            rest(s, VOCABULARY_LEVEL_STATUS_DONE);
            return TASK_LINE_ACQUIRE_9;
        }
        break;
    default:
        break;
    }
    return TASK_LINE_ACQUIRE_16;
}

static int32_t emove_failed(task_t *s)
{
    int32_t line;
    uint8_t reason;
    switch (s->emove.command) {
    case VCBLRY_EMOVE_CMND_MOVE_TO:
    case VCBLRY_EMOVE_CMND_MOVE_TO_OBJ:
        line = (s->emove.command == VCBLRY_EMOVE_CMND_MOVE_TO) ? TASK_LINE_ACQUIRE_10 : TASK_LINE_ACQUIRE_11;
        reason = VOCABULARY_REASON_MOVE;
        s->remember_current_loc = 0u;
        if (s->emove.failure == VOCABULARY_REASON_NOTHING_GRIPPED) {
            reason = VOCABULARY_REASON_NOTHING_GRIPPED;
            nothing_gripped(s);
        }
        break;
    case VCBLRY_EMOVE_CMND_LOCATE:
        line = TASK_LINE_ACQUIRE_12;
        reason = VOCABULARY_REASON_LOC;
        break;
    case VCBLRY_EMOVE_CMND_PICKUP:
        line = TASK_LINE_ACQUIRE_13;
        reason = VOCABULARY_REASON_PIC;
        pick_failed(s);
        break;
    case VCBLRY_EMOVE_CMND_PAUSE:
        if (s->cur_state == TASK_COMMON_TASK_STATE_D_STATE) {
            rest(s, VOCABULARY_LEVEL_STATUS_DONE);
            return TASK_LINE_ACQUIRE_9;
        }
        return TASK_LINE_ACQUIRE_16;
    default:
        return TASK_LINE_ACQUIRE_16;
    }
    s->to_workstation.cause = s->emove.failure;
    fail(s, reason);
    s->to_emove.input_command = VCBLRY_EMOVE_CMND_PAUSE;
    return line;
}

static int32_t go_on(task_t *s)
{
    int32_t line;
    if (s->cur_state == TASK_COMMON_TASK_STATE_F_STATE) {
        rest(s, VOCABULARY_LEVEL_STATUS_FAILED);
        return TASK_LINE_ACQUIRE_14;
    }
    switch (s->emove.status) {
    case VOCABULARY_LEVEL_STATUS_DONE:
        line = emove_done(s);
        break;
    case VOCABULARY_LEVEL_STATUS_EXECUTING:
        line = emove_executing(s);
        break;
    default:
        line = emove_failed(s);
        break;
    }
    if (line == TASK_LINE_ACQUIRE_16) {
        fail(s, VOCABULARY_REASON_STATE);
        s->to_emove.input_command = VCBLRY_EMOVE_CMND_PAUSE;
    }
    return line;
}

int32_t switch_acquire_step(task_t *s)
{
    const int32_t at = refused(s);
    s->line = -1;
    s->fault = TASK_FAULT_NONE;
    s->fault_at = at;
    s->assumptions_failed = 0;
    if (at >= 0) {
        s->fault = TASK_FAULT_ADMIT;
        return TASK_FAULT_ADMIT;
    }
    if (s->from_emove.inc_command_echo == s->to_emove.inc_command) {
        s->cur_state = s->cur_state_next;
    }
    monitor(s);
    s->line = s->new_command ? begin_command(s) : go_on(s);
    return TASK_FAULT_NONE;
}
