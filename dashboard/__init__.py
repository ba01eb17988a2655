"""The dashboard: a web page that shows a cell and sends what people ask of it."""
