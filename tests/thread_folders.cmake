# Folders of tests that are built and run with ThreadSanitizer: what has threads.
set(thread_folders
  tests/conformance
  tests/unit/drivers/camera
  tests/unit/drivers/trigger
  tests/unit/firmware/base
  tests/unit/firmware/daemon
  tests/unit/firmware/daemon/models
  tests/unit/firmware/pipeline)
