// Fusion of depth maps as in S. Galliani et al. (Gipuma), ICCV 2015, section 5, and J. Schoenberger
// et al., ECCV 2016, section 4.6: consistent pixels are averaged and used up.
#include "sfm/dense/fusion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

/// A view with what is needed of it; the first is the one being fused, the rest its neighbours.
struct LoadedView {
  std::size_t view = 0;
  PosedDepthMap posed;
  ViewImage image;
  Rigid3 world_from_cam;
};

/// A pixel of a neighbour that went into a point.
struct UsedPixel {
  std::size_t view = 0;
  int x = 0;
  int y = 0;
};

struct FusedRow {
  DenseCloud points;
  std::vector<UsedPixel> used;
};

struct PointSum {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  std::size_t count = 0;
};

Result<LoadedView> load_view(const FusionInput& input, std::size_t v) {
  LoadedView loaded;
  loaded.view = v;
  TM_ASSIGN_OR_RETURN(loaded.posed.map, input.maps->load(v));
  if (loaded.posed.map.depth.empty()) {
    return loaded;
  }
  TM_ASSIGN_OR_RETURN(loaded.image, input.images->load(v));
  loaded.posed.cam_from_world = input.views[v].cam_from_world;
  loaded.world_from_cam = loaded.posed.cam_from_world.inverse();
  return loaded;
}

/// Bilinear colour of the photograph at a pixel of the (smaller) map.
Eigen::Vector3d color_at(const LoadedView& view, int x, int y) {
  const cv::Mat& rgb = view.image.rgb;
  const double u =
      std::clamp((x + 0.5) * rgb.cols / view.posed.map.depth.cols - 0.5, 0.0, rgb.cols - 1.0);
  const double v =
      std::clamp((y + 0.5) * rgb.rows / view.posed.map.depth.rows - 0.5, 0.0, rgb.rows - 1.0);
  const int x0 = static_cast<int>(u);
  const int y0 = static_cast<int>(v);
  const int x1 = std::min(x0 + 1, rgb.cols - 1);
  const int y1 = std::min(y0 + 1, rgb.rows - 1);
  const auto pixel = [&](int column, int row) {
    const auto& p = rgb.at<cv::Vec3b>(row, column);
    return Eigen::Vector3d(p[0], p[1], p[2]);
  };
  const double fx = u - x0;
  const double fy = v - y0;
  return (1.0 - fy) * ((1.0 - fx) * pixel(x0, y0) + fx * pixel(x1, y0)) +
         fy * ((1.0 - fx) * pixel(x0, y1) + fx * pixel(x1, y1));
}

void add_pixel(const LoadedView& view, int x, int y, PointSum& sum) {
  const DepthMap& map = view.posed.map;
  const double depth = static_cast<double>(map.depth.at<float>(y, x));
  const Eigen::Vector3d point((x - map.camera.cx_px) / map.camera.fx_px * depth,
                              (y - map.camera.cy_px) / map.camera.fy_px * depth,
                              depth);
  const auto& n = map.normal.at<cv::Vec3f>(y, x);
  sum.position += view.world_from_cam * point;
  sum.normal += view.world_from_cam.rotation * Eigen::Vector3f(n[0], n[1], n[2]).cast<double>();
  sum.color += color_at(view, x, y);
  ++sum.count;
}

DensePoint finish_point(const PointSum& sum, std::uint8_t confidence) {
  const double scale = 1.0 / static_cast<double>(sum.count);
  DensePoint point;
  point.position_in_world = (sum.position * scale).cast<float>();
  point.normal_in_world = sum.normal.normalized().cast<float>();
  for (std::size_t c = 0; c < 3; ++c) {
    point.color_rgb[c] = static_cast<std::uint8_t>(
        std::clamp(std::lround(sum.color[static_cast<Eigen::Index>(c)] * scale), 0L, 255L));
  }
  point.confidence = static_cast<float>(confidence) / 255.0F;
  point.view_count = static_cast<std::uint16_t>(sum.count);
  return point;
}

/// One view's pass over its pixels that are not used up.
struct FusionTask {
  std::span<const LoadedView> loaded;          ///< the view, its neighbours
  std::span<const MapComparison> comparisons;  ///< one a neighbour
  const FusionOptions& options;
  const cv::Mat& used;  ///< of the view
};

FusedRow fuse_row(const FusionTask& task, int y) {
  FusedRow out;
  const LoadedView& view = task.loaded.front();
  const DepthMap& map = view.posed.map;
  std::vector<UsedPixel> partners;
  for (int x = 0; x < map.depth.cols; ++x) {
    if (!(map.depth.at<float>(y, x) > 0.0F) || task.used.at<std::uint8_t>(y, x) != 0) {
      continue;
    }
    PointSum sum;
    add_pixel(view, x, y, sum);
    partners.clear();
    for (std::size_t n = 0; n < task.comparisons.size(); ++n) {
      const MapOpinion opinion = task.comparisons[n].ask(x, y);
      if (opinion.verdict == MapVerdict::kAgrees) {
        add_pixel(task.loaded[n + 1], opinion.x, opinion.y, sum);
        partners.push_back({task.loaded[n + 1].view, opinion.x, opinion.y});
      }
    }
    if (sum.count >= task.options.min_views) {
      out.points.push_back(finish_point(sum, map.confidence.at<std::uint8_t>(y, x)));
      out.used.insert(out.used.end(), partners.begin(), partners.end());
    }
  }
  return out;
}

/// Adds the points of a view to the cloud and marks what they use of its neighbours. In bands of
/// rows, because the marks of a row take more memory than its points.
void fuse_view(const FusionTask& task,
               std::vector<cv::Mat>& used,
               DenseCloud& cloud,
               Executor& executor) {
  constexpr int kBandRows = 32;
  const int height = task.loaded.front().posed.map.depth.rows;
  for (int top = 0; top < height; top += kBandRows) {
    std::vector<FusedRow> rows(static_cast<std::size_t>(std::min(kBandRows, height - top)));
    executor.for_each_index(rows.size(), [&](std::size_t row) {
      rows[row] = fuse_row(task, top + static_cast<int>(row));
    });
    for (const FusedRow& row : rows) {
      cloud.insert(cloud.end(), row.points.begin(), row.points.end());
      for (const UsedPixel& pixel : row.used) {
        used[pixel.view].at<std::uint8_t>(pixel.y, pixel.x) = 255;
      }
    }
  }
}

Result<std::vector<LoadedView>> load_group(const FusionInput& input, std::size_t v) {
  std::vector<LoadedView> loaded;
  TM_ASSIGN_OR_RETURN(LoadedView own, load_view(input, v));
  if (own.posed.map.depth.empty()) {
    return loaded;
  }
  loaded.push_back(std::move(own));
  for (const std::size_t n : input.neighbors[v]) {
    TM_CHECK(n < input.views.size());
    TM_ASSIGN_OR_RETURN(LoadedView neighbor, load_view(input, n));
    if (!neighbor.posed.map.depth.empty()) {
      loaded.push_back(std::move(neighbor));
    }
  }
  return loaded;
}

}  // namespace

Result<> FusionOptions::validate() const {
  TM_RETURN_IF_ERROR(agreement.validate());
  if (min_views < 1 || min_views > 16) {
    return fail(ErrorCode::kInvalidArgument, "min_views is {}, not in [1, 16]", min_views);
  }
  if (max_points == 0) {
    return fail(ErrorCode::kInvalidArgument, "max_points is 0, not > 0");
  }
  return {};
}

Result<DenseCloud> fuse_depth_maps(const FusionInput& input,
                                   const FusionOptions& options,
                                   Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  TM_CHECK(input.maps != nullptr && input.images != nullptr);
  if (input.neighbors.size() != input.views.size()) {
    return fail(ErrorCode::kInvalidArgument,
                "{} lists of neighbours for {} views",
                input.neighbors.size(),
                input.views.size());
  }
  DenseCloud cloud;
  std::vector<cv::Mat> used(input.views.size());
  for (std::size_t v = 0; v < input.views.size(); ++v) {
    TM_ASSIGN_OR_RETURN(const std::vector<LoadedView> loaded, load_group(input, v));
    if (loaded.empty()) {
      continue;
    }
    std::vector<MapComparison> comparisons;
    for (const LoadedView& view : loaded) {
      if (used[view.view].empty()) {
        used[view.view] = cv::Mat(view.posed.map.depth.size(), CV_8UC1, cv::Scalar(0));
      }
      if (view.view != v) {
        comparisons.emplace_back(loaded.front().posed, view.posed, options.agreement);
      }
    }
    fuse_view({loaded, comparisons, options, used[v]}, used, cloud, executor);
    used[v] = cv::Scalar(255);
    if (cloud.size() > options.max_points) {
      return fail(
          ErrorCode::kLimitExceeded, "the cloud has more than {} points", options.max_points);
    }
  }
  return cloud;
}

}  // namespace trigmesh
