//! No code: the manifest asks for features of dependencies, so that all builds of the workspace share them.
