/* {title}
 *
 * Control law of problem {problem}, written {created} by maglev-workbench {version}.
 * Gain table, SHA-256: {digest}
 * Problem data, SHA-256: {data}
 *
 * Gains:
{gains}
 *
 * Filters: Tustin's rule without prewarping. The response of a command to a unit step of a sensor{place} differs at
 * no sample by more than {step_error} from that of the continuous law, chiefly because the trapezoidal rule takes a
 * step half a sample early. Commands are not limited here.
 *
{check}
 *
 * Sensors, in this order, deviations from the nominal gap and accelerations, one of each per coil set:
{order}
 * Gaps count positive away from the guideway, accelerations in the direction that opens the gap. Coil sets, from the
 * centre of gravity:
{sets}
 * Commands, in this order:
{commands}
 *
 * Use: {use}
 * A sensor value that is no finite number stays in the filters until wb_init: check the sensors before.
 * C99 or later. Define WB_FLOAT before including for single precision.
 */
#ifndef WB_LAW_H
#define WB_LAW_H

#ifdef WB_FLOAT
typedef float wb_real;
#define WB_R(literal) literal##F
#else
typedef double wb_real;
#define WB_R(literal) literal
#endif

#define WB_PROBLEM "{problem}"
#define WB_DIGEST "{digest}"
#define WB_COIL_SETS {count}
#define WB_SENSORS {sensors}
#define WB_COMMANDS {command_count}
#define WB_CHANNELS 5
#define WB_FILTERS 10
#define WB_SAMPLE_TIME {sample} /* s */

/* A filter: s += advance (u - s), output = direct u + memory s, both with the s of the step before. */
typedef struct {{
    wb_real advance, direct, memory;
}} wb_coefficients;

/* What the filters remember between steps: the low-pass of each modal signal (gaps in m or rad, then accelerations in
 * m/s^2 or rad/s^2), in the order {channels}. */
typedef struct {{
    wb_real low_pass[WB_FILTERS];
{state}}} wb_state;

/* Heave, pitch, roll from the vertical signals of the coil sets; sway, yaw from the lateral ones. */
static const wb_real wb_vertical[{vertical_count}][WB_COIL_SETS] = {{
{vertical}
}};
static const wb_real wb_lateral[{lateral_count}][WB_COIL_SETS] = {{
{lateral}
}};

{law}
/* Filters at rest. */
static inline void wb_init(wb_state *state)
{{
    int k;
    for (k = 0; k < WB_FILTERS; k++) {{
        state->low_pass[k] = WB_R(0.0);
    }}
}}

/* One modal signal: a row of weights times the sensors of one kind. */
static inline wb_real wb_modal(const wb_real weights[WB_COIL_SETS], const wb_real *sensors)
{{
    wb_real sum = WB_R(0.0);
    int i;
    for (i = 0; i < WB_COIL_SETS; i++) {{
        sum += weights[i] * sensors[i];
    }}
    return sum;
}}

/* One sample: commands from sensors. */
static inline void wb_step(wb_state *state, const wb_real sensors[WB_SENSORS], wb_real commands[WB_COMMANDS])
{{
    wb_real filtered[WB_CHANNELS];
    int i, k, kind;
    for (k = 0; k < WB_CHANNELS; k++) {{
        filtered[k] = WB_R(0.0);
    }}
    for (kind = 0; kind < 2; kind++) {{ /* gaps, then accelerations */
        const wb_real *vertical = sensors + 2 * kind * WB_COIL_SETS;
        for (k = 0; k < WB_CHANNELS; k++) {{
            const int f = kind * WB_CHANNELS + k;
            const wb_real u = k < {vertical_count} ? wb_modal(wb_vertical[k], vertical)
                                    : wb_modal(wb_lateral[k - {vertical_count}], vertical + WB_COIL_SETS);
            filtered[k] += {owner}filter[f].direct * u + {owner}filter[f].memory * state->low_pass[f];
            state->low_pass[f] += {owner}filter[f].advance * (u - state->low_pass[f]);
        }}
    }}
    for (i = 0; i < WB_COMMANDS; i++) {{
        wb_real sum = WB_R(0.0);
        for (k = 0; k < WB_CHANNELS; k++) {{
            sum += {owner}resolution[i][k] * filtered[k];
        }}
        commands[i] = sum;
    }}
}}

#endif /* WB_LAW_H */
