"""A control-design workbench for magnetically levitated vehicles."""
