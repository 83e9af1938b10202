"""The node `simulator`: `node` has the loop and the services, `topics` the publishers."""
