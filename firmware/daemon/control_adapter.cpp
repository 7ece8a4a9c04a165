#include "firmware/daemon/control_adapter.hpp"

#include <future>
#include <memory>
#include <utility>

#include "firmware/control/control_events.hpp"

namespace trigmesh {
namespace {

/// Watchers are not flooded.
constexpr std::chrono::milliseconds kEventInterval(500);

/// Calls `ask` with a function that takes the answer, and waits for it. The answer may come after
/// the time is over: nobody hears it then.
template <typename T, typename Ask>
Result<T> wait_for_answer(std::chrono::milliseconds patience, Ask ask) {
  auto promised = std::make_shared<std::promise<Result<T>>>();  // shared with a late answer
  std::future<Result<T>> answer = promised->get_future();
  ask([promised](Result<T> result) { promised->set_value(std::move(result)); });
  if (answer.wait_for(patience) != std::future_status::ready) {
    return fail(ErrorCode::kIo,
                "no answer within {} ms: the disk or the camera is slow; look at the status",
                patience.count());
  }
  try {
    return answer.get();
  } catch (const std::future_error&) {  // the question was dropped
    return fail(ErrorCode::kCancelled, "the program ends");
  }
}

}  // namespace

Result<ControlStatus> ControlAdapter::status() {
  ControlStatus status = parts_.status.status();
  status.fault = parts_.faults.text();
  return status;
}

Result<> ControlAdapter::command(CommandKind kind) {
  return wait_for_answer<void>(patience_, [&](auto answer) {
    (void)parts_.rig.push(Command{kind, parts_.clock.now(), std::move(answer)});
  });
}

Result<> ControlAdapter::continue_session(const std::string& id) {
  return wait_for_answer<void>(patience_, [&](auto answer) {
    (void)parts_.rig.push(
        Command{CommandKind::kContinue, parts_.clock.now(), std::move(answer), id});
  });
}

Result<std::vector<SessionInfo>> ControlAdapter::sessions() {
  return wait_for_answer<std::vector<SessionInfo>>(
      patience_, [&](auto answer) { parts_.storage.push(ListOrder{std::move(answer)}); });
}

Result<> ControlAdapter::remove_session(const std::string& id) {
  return wait_for_answer<void>(patience_, [&](auto answer) {
    parts_.storage.push(RemoveOrder{id, std::move(answer)});
  });
}

Result<ExportReport> ControlAdapter::export_session(const std::string& id,
                                                    const std::filesystem::path& destination) {
  const auto folder = wait_for_answer<std::filesystem::path>(patience_, [&](auto answer) {
    parts_.storage.push(BeginExportOrder{id, std::move(answer)});
  });
  if (!folder) {
    return tl::unexpected<Error>(folder.error());
  }
  std::chrono::nanoseconds told{};
  const auto progress = [&](std::uint64_t copied_bytes, std::uint64_t all_bytes) {
    const std::chrono::nanoseconds now = parts_.clock.now();
    if (now - told >= kEventInterval || copied_bytes == all_bytes) {
      told = now;
      parts_.publish(kExportEvent, render_export_event({id, copied_bytes, all_bytes}));
    }
    return true;
  };
  Result<ExportReport> report =
      trigmesh::export_session(parts_.files, *folder, destination, progress);
  const ExportEnd end = report ? ExportEnd::kVerified : ExportEnd::kFailed;
  const Result<> noted = wait_for_answer<void>(patience_, [&](auto answer) {
    parts_.storage.push(EndExportOrder{id, end, std::move(answer)});
  });
  if (report) {
    write_log(LogLevel::kInfo,
              "session is exported",
              {{"session", id}, {"destination", report->folder.string()}});
  }
  if (report && !noted) {
    return tl::unexpected<Error>(noted.error());
  }
  return report;
}

}  // namespace trigmesh
