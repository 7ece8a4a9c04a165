#pragma once

#include <filesystem>
#include <utility>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// Where a model lies, and how a new version of it comes to be seen. Thread-compatible.
class ModelPlace {
 public:
  ModelPlace() = default;
  ModelPlace(const ModelPlace&) = delete;
  ModelPlace& operator=(const ModelPlace&) = delete;
  ModelPlace(ModelPlace&&) = delete;
  ModelPlace& operator=(ModelPlace&&) = delete;
  virtual ~ModelPlace() = default;

  /// The folder of the finished model; missing when there is none yet.
  [[nodiscard]] virtual std::filesystem::path model() const = 0;

  /// The folder in which the next version is put together, in sight of nobody, on the same file
  /// system. What an earlier call left there is of no use.
  [[nodiscard]] virtual std::filesystem::path staged() const = 0;

  /// Puts what is in staged() in the place of model() in one step: a reader sees the old version or
  /// the new one. kNoSpace, kIo.
  [[nodiscard]] virtual Result<> publish() = 0;
};

/// `output`/model, put together in `output`/.model.part.
class ModelFolder final : public ModelPlace {
 public:
  explicit ModelFolder(std::filesystem::path output) : output_(std::move(output)) {}

  [[nodiscard]] std::filesystem::path model() const override { return output_ / "model"; }

  [[nodiscard]] std::filesystem::path staged() const override { return output_ / ".model.part"; }

  [[nodiscard]] Result<> publish() override;

 private:
  std::filesystem::path output_;
};

}  // namespace trigmesh
