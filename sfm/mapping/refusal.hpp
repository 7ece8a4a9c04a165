#pragma once

#include "sfm/mapping/image_store.hpp"
#include "sfm/mapping/map.hpp"
#include "sfm/scene/outcome.hpp"

namespace trigmesh {

/// Why an image without a pose has none, from what the store knows of it: features, pairs, the last
/// try.
[[nodiscard]] ImageOutcome explain_refusal(const ImageStore& store,
                                           ViewId view,
                                           const MapperOptions& options);

/// Fills in the entry of a registered view: component, observations, reprojection error;
/// kOtherComponent unless `component` is 0.
void describe_registration(ImageOutcome& outcome, const Map& map, ViewId view, int component);

}  // namespace trigmesh
