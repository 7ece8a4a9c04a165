# The maker of models, apart from the rest of the daemon: it brings the whole pipeline with it.
trigmesh_add_library(
  NAME firmware_daemon_models
  SOURCES "${CMAKE_CURRENT_LIST_DIR}/model_worker.cpp"
  HEADERS
    "${CMAKE_CURRENT_LIST_DIR}/model_worker.hpp"
    "${CMAKE_CURRENT_LIST_DIR}/session_model_place.hpp"
  PUBLIC trigmesh_firmware_pipeline trigmesh_firmware_session trigmesh_firmware_settings Threads::Threads
  PRIVATE trigmesh_firmware_photos trigmesh_sfm_exchange)
