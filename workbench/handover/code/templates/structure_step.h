    wb_real move[WB_STATES];
    int i, j;
    for (i = 0; i < WB_OUTPUTS; i++) {
        wb_real sum = WB_R(0.0);
        for (j = 0; j < WB_STATES; j++) {
            sum += wb_output[i][j] * state->x[j];
        }
        for (j = 0; j < WB_INPUTS; j++) {
            sum += wb_direct[i][j] * inputs[j];
        }
        outputs[i] = sum;
    }
    for (i = 0; i < WB_STATES; i++) {
        wb_real sum = WB_R(0.0);
        for (j = 0; j < WB_STATES; j++) {
            sum += wb_move[i][j] * state->x[j];
        }
        for (j = 0; j < WB_INPUTS; j++) {
            sum += wb_input[i][j] * inputs[j];
        }
        move[i] = sum;
    }
    for (i = 0; i < WB_STATES; i++) {
        state->x[i] += move[i];
    }
