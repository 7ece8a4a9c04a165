// Orders about sessions that are not being captured: their models, the list, removal and export.

#include <utility>

#include "firmware/daemon/storage.hpp"

namespace trigmesh {

void Storage::do_order(BeginModelOrder order) {
  if (!store_.is_open()) {
    open_store();
  }
  Result<Session> session = store_.is_open()
                                ? store_.open_for_model(order.id)
                                : fail(ErrorCode::kIo, "{}", parts_.faults.text_of("storage"));
  if (!session) {
    (void)parts_.rig.push(ModelAnswer{order.id, ModelOutcome::kFailed, session.error().message});
    return;
  }
  write_log(LogLevel::kInfo, "model is begun", {{"session", order.id}});
  model_id_ = order.id;
  parts_.models.begin(*std::move(session));
}

void Storage::do_order(StopModelOrder /*order*/) {
  parts_.models.request_stop();
}

void Storage::do_order(ModelEndedOrder order) {
  model_id_.clear();
  if (order.end != ModelEnd::kOver && store_.is_open()) {
    if (const auto noted = store_.model_stopped(order.id, order.end); !noted) {
      write_log(LogLevel::kWarn, noted.error().message, {{"session", order.id}});
    }
  }
  check_level();  // models take space, too
}

void Storage::do_order(const ListOrder& order) {
  order.answer(store_.is_open() ? store_.store().list()
                                : fail(ErrorCode::kIo, "{}", parts_.faults.text_of("storage")));
}

Result<> Storage::check_unused(const std::string& id) {
  if (!store_.is_open()) {
    return fail(ErrorCode::kIo, "{}", parts_.faults.text_of("storage"));
  }
  const char* use = nullptr;
  if (store_.has_session() && store_.session().manifest().id == id) {
    use = "it is open: finish it first";
  } else if (id == model_id_) {
    use = "its model is being made: wait, or cancel it";
  } else if (id == export_id_) {
    use = "it is being exported: wait";
  }
  return use == nullptr
             ? Result<>()
             : fail(ErrorCode::kInsufficientData, "cannot use session {} now: {}", id, use);
}

void Storage::do_order(RemoveOrder order) {
  Result<> removed =
      check_unused(order.id).and_then([&] { return store_.store().remove(order.id); });
  if (removed) {
    write_log(LogLevel::kInfo, "session is removed", {{"session", order.id}});
  }
  order.answer(std::move(removed));
  check_level();
}

void Storage::do_order(BeginExportOrder order) {
  if (!export_id_.empty()) {
    order.answer(fail(ErrorCode::kInsufficientData,
                      "cannot export session {}: {} is being exported; wait",
                      order.id,
                      export_id_));
    return;
  }
  if (const auto unused = check_unused(order.id); !unused) {
    order.answer(tl::unexpected<Error>(unused.error()));
    return;
  }
  export_id_ = order.id;
  order.answer(store_.store().folder_of(order.id));
}

void Storage::do_order(const EndExportOrder& order) {
  export_id_.clear();
  if (order.end == ExportEnd::kFailed || !store_.is_open()) {
    order.answer({});
    return;
  }
  order.answer(store_.mark_exported(order.id));
}

}  // namespace trigmesh
