"""A local surface that counts what is projected on it."""


class Counted:
    def __init__(self, surface):
        self.surface, self.count = surface, 0

    def project(self, x, progress=None):
        self.count += len(x)
        return self.surface.project(x, progress)
