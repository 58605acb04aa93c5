"""Reports of flights: page, plots, tables, exports, gallery."""
