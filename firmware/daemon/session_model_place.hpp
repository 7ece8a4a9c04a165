#pragma once

#include "firmware/pipeline/model_place.hpp"
#include "firmware/session/session.hpp"

namespace trigmesh {

/// The model of a session: put together where the session wants it, and put in its place by it,
/// with everything on the disk before it is seen.
class SessionModelPlace final : public ModelPlace {
 public:
  /// `session` outlives the place.
  explicit SessionModelPlace(Session& session) : session_(session) {}

  [[nodiscard]] std::filesystem::path model() const override { return session_.model(); }

  [[nodiscard]] std::filesystem::path staged() const override { return session_.staged_model(); }

  [[nodiscard]] Result<> publish() override { return session_.publish_model(); }

 private:
  Session& session_;
};

}  // namespace trigmesh
