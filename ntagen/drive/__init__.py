"""The online controller: measure, estimate, synthesise, steer; its devices, log and replay."""
