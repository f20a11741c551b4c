"""The box: a page in the browser that shows a fleet live, and hands what is drawn and pressed there to the wire."""
