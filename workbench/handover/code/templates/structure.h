/* {title}
 *
 * Controller of problem {problem}, written {created} by maglev-workbench {version}.
 * Gain table, SHA-256: {digest}
 * Problem data, SHA-256: {data}
 *
 * Parameters:
{parameters}
 *
 * Continuous blocks by Tustin's rule without prewarping. Commands are not limited here.
 *
{check}
 *
 * Use: wb_state state; wb_init(&state); then wb_step(&state, inputs, outputs) every WB_SAMPLE_TIME seconds.
 * Inputs and outputs in the order of the names below, in the units of the model.
 * An input that is no finite number stays in the states until wb_init: check the inputs before.
 * C99 or later, C++ too. Define WB_FLOAT before including for single precision.
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
#define WB_INPUTS {inputs}
#define WB_OUTPUTS {outputs}
#define WB_STATES {state_count}
#define WB_SAMPLE_TIME {sample} /* s */

{input_names}
{output_names}

typedef struct {{
    wb_real x[{states}];
}} wb_state;

{tables}
/* States at rest. */
static inline void wb_init(wb_state *state)
{{
{rest}}}

/* One sample: outputs from inputs. */
static inline void wb_step(wb_state *state, const wb_real inputs[WB_INPUTS], wb_real outputs[WB_OUTPUTS])
{{
{step}}}

#endif /* WB_LAW_H */
