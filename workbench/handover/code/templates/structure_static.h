    int i, j;
    (void)state;
    for (i = 0; i < WB_OUTPUTS; i++) {
        wb_real sum = WB_R(0.0);
        for (j = 0; j < WB_INPUTS; j++) {
            sum += wb_direct[i][j] * inputs[j];
        }
        outputs[i] = sum;
    }
