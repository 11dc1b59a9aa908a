/* Commands from the filtered channels, modal gains included. */
static const wb_real wb_resolution[WB_COMMANDS][WB_CHANNELS] = {{
{resolution}
}};

static const wb_coefficients wb_filter[WB_FILTERS] = {{
{filters}
}};
