#define WB_SPEED_LOWEST {low} /* m/s */
#define WB_SPEED_HIGHEST {high} /* m/s */
#define WB_DEGREE {degree}
#define WB_PARAMETERS {parameters}
#define WB_MODAL {modal}

/* Each parameter over speed: coefficients of rising powers of (speed - {centre}) / {scale}. */
static const wb_real wb_polynomial[WB_PARAMETERS][WB_DEGREE + 1] = {{
{polynomials}
}};

/* Which parameters make a filter: position (or direct), rate (or velocity), time constant; 1 for a gap's filter. */
static const int wb_pair[WB_FILTERS][4] = {{
{pairs}
}};

/* Commands from the filtered channels per unit of each modal gain. */
static const wb_real wb_resolution[WB_MODAL][WB_COMMANDS][WB_CHANNELS] = {{
{resolutions}
}};

/* Filters and resolution at a speed [m/s]; what the filters remember stays. */
static inline void wb_set_speed(wb_state *state, wb_real speed)
{{
    wb_real gain[WB_PARAMETERS], t;
    int f, i, k, m;
    if (!(speed > WB_SPEED_LOWEST)) {{ /* a speed that is not a number included */
        speed = WB_SPEED_LOWEST;
    }} else if (speed > WB_SPEED_HIGHEST) {{
        speed = WB_SPEED_HIGHEST;
    }}
    t = (speed - {centre}) / {scale};
    for (k = 0; k < WB_PARAMETERS; k++) {{
        gain[k] = wb_polynomial[k][WB_DEGREE];
        for (m = WB_DEGREE - 1; m >= 0; m--) {{
            gain[k] = gain[k] * t + wb_polynomial[k][m];
        }}
    }}
    for (f = 0; f < WB_FILTERS; f++) {{
        const wb_real position = gain[wb_pair[f][0]], rate = gain[wb_pair[f][1]], tau = gain[wb_pair[f][2]];
        const wb_real span = WB_SAMPLE_TIME + WB_R(2.0) * tau;
        wb_coefficients *c = &state->filter[f];
        c->advance = WB_R(2.0) * WB_SAMPLE_TIME / span;
        if (wb_pair[f][3]) {{
            c->memory = -WB_R(2.0) * rate / span;
            c->direct = position - c->memory;
        }} else {{
            c->memory = rate * tau * (WB_R(2.0) * tau / span);
            c->direct = position + rate * tau * (WB_SAMPLE_TIME / span);
        }}
    }}
    for (i = 0; i < WB_COMMANDS; i++) {{
        for (k = 0; k < WB_CHANNELS; k++) {{
            wb_real sum = WB_R(0.0);
            for (m = 0; m < WB_MODAL; m++) {{
                sum += gain[{first} + m] * wb_resolution[m][i][k];
            }}
            state->resolution[i][k] = sum;
        }}
    }}
}}
