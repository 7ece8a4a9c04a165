#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/checkpoint.hpp"
#include "sfm/dense/depth_map.hpp"

namespace trigmesh {

/// Bytes for the work folder and back. Decoding anything else gives kCorruptData.
[[nodiscard]] std::vector<std::uint8_t> encode_depth_map(const DepthMap& map);
[[nodiscard]] Result<DepthMap> decode_depth_map(std::span<const std::uint8_t> bytes);

/// The depth maps of one round of work, on disk under a name and a key each, so that only those
/// that are being worked on take memory and an interrupted call finds the finished ones.
class DepthMapStore final : public DepthMapSource {
 public:
  /// `folder` outlives the store. `round` names the files; `keys`: one a view, of everything that
  /// its map depends on.
  DepthMapStore(const CheckpointFolder& folder, std::string round, std::vector<std::uint64_t> keys)
      : folder_(&folder), round_(std::move(round)), keys_(std::move(keys)) {}

  /// kIo, kNoSpace.
  [[nodiscard]] Result<> save(std::size_t view, const DepthMap& map) const;

  /// Whether the map of the view is there, whole and up to date.
  [[nodiscard]] bool has(std::size_t view) const;

  /// kCorruptData when the map is not there: it was made before, and somebody removed or damaged
  /// it.
  [[nodiscard]] Result<DepthMap> load(std::size_t view) const override;

 private:
  [[nodiscard]] std::string name_of(std::size_t view) const;

  const CheckpointFolder* folder_;
  std::string round_;
  std::vector<std::uint64_t> keys_;
};

}  // namespace trigmesh
