// Judges the texture of a finished reconstruction: textures its mesh without every n-th photograph
// and compares what the left out cameras see with what they took.

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/photo_images.hpp"
#include "firmware/pipeline/surface_plan.hpp"
#include "firmware/pipeline/worker_pool.hpp"
#include "sfm/dense/undistortion.hpp"
#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "sfm/exchange/model_folder.hpp"
#include "sfm/exchange/ply.hpp"
#include "sfm/texture/image_similarity.hpp"
#include "sfm/texture/texture_surface.hpp"
#include "sfm/texture/textured_render.hpp"
#include "tools/trigmesh/photo_input.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

constexpr double kDifferenceGain = 4.0;  // small differences must be seen in the pictures

struct Arguments {
  std::string result;
  std::string photos;
  std::string output;
  std::size_t every = 8;
  int threads = 2;
  bool no_masks = false;
  BuildOptions build;
};

/// Some of the pictures of another source.
class ChosenImages final : public ViewImageSource {
 public:
  ChosenImages(const ViewImageSource& all, std::vector<std::size_t> chosen)
      : all_(all), chosen_(std::move(chosen)) {}

  [[nodiscard]] Result<ViewImage> load(std::size_t view) const override {
    return all_.load(chosen_[view]);
  }

 private:
  const ViewImageSource& all_;
  std::vector<std::size_t> chosen_;
};

/// Squared error and similarity of several views, weighted by their covered pixels.
struct Totals {
  double squared_error = 0.0;
  double similarity = 0.0;
  double covered = 0.0;
  double pixels = 0.0;

  void add(const ImageSimilarity& view, double pixel_count) {
    const auto count = static_cast<double>(view.pixel_count);
    squared_error += count * std::pow(10.0, -view.psnr_db / 10.0);
    similarity += count * view.ssim;
    covered += count;
    pixels += pixel_count;
  }

  void print() const {
    const double count = std::max(1.0, covered);
    fmt::print("all: PSNR {:.2f} dB, SSIM {:.4f}, {:.1f} % of the pixels covered\n",
               -10.0 * std::log10(std::max(1e-10, squared_error / count)),
               similarity / count,
               100.0 * covered / std::max(1.0, pixels));
  }
};

void print_report(const TextureReport& report) {
  fmt::print("{} faces, {} with a picture ({:.2f} %), {} views, {} looks rejected\n",
             report.face_count,
             report.textured_face_count,
             100.0 * static_cast<double>(report.textured_face_count) /
                 static_cast<double>(report.face_count),
             report.view_count,
             report.rejected_look_count);
  fmt::print(
      "{} charts on {} page(s) of {}, filled {:.1f} %, {:.2f} texels a pixel, texel {:.4g}\n",
      report.chart_count,
      report.page_count,
      report.page_size_px,
      100.0 * report.atlas_fill_ratio,
      report.texels_per_pixel,
      report.texel_size);
  fmt::print("step across seams {:.2f} -> {:.2f} (gains {:.2f} to {:.2f}) -> {:.2f} grey levels\n",
             report.seam_step_before,
             report.seam_step_after_gains,
             report.smallest_gain,
             report.largest_gain,
             report.seam_step_after);
}

/// Photograph, rendering and their difference (grey where nothing is covered), side by side.
cv::Mat side_by_side(const cv::Mat& photograph, const RenderedView& rendered) {
  const cv::Size size = photograph.size();
  cv::Mat picture(size.height, 3 * size.width, CV_8UC3);
  const auto part = [&](int index) {
    return picture(cv::Rect(index * size.width, 0, size.width, size.height));
  };
  photograph.copyTo(part(0));
  rendered.rgb.copyTo(part(1));
  cv::Mat difference;
  cv::absdiff(photograph, rendered.rgb, difference);
  difference *= kDifferenceGain;
  difference.setTo(cv::Scalar(128, 128, 128), rendered.coverage == 0);
  difference.copyTo(part(2));
  return picture;
}

Result<ImageSimilarity> judge_view(const TexturedMesh& textured,
                                   const DenseView& view,
                                   const cv::Mat& photograph,
                                   const std::string& output) {
  const RenderedView rendered = render_textured(textured, view.camera, view.cam_from_world);
  const ImageSimilarity similarity = compare_images(rendered.rgb, photograph, rendered.coverage);
  fmt::print("{}: PSNR {:.2f} dB, SSIM {:.4f}, {:.1f} % covered\n",
             view.name,
             similarity.psnr_db,
             similarity.ssim,
             100.0 * static_cast<double>(similarity.pixel_count) /
                 static_cast<double>(photograph.total()));
  if (!output.empty()) {
    TM_ASSIGN_OR_RETURN(const auto png, encode_png(side_by_side(photograph, rendered)));
    const fs::path file = fs::path(output) / (fs::path(view.name).stem().string() + ".png");
    TM_RETURN_IF_ERROR(write_file_atomically(
        file, {reinterpret_cast<const char*>(png.data()), png.size()}, Durability::kCache));
  }
  return similarity;
}

Result<TextureResult> texture_without(const TriangleMesh& mesh,
                                      const std::vector<DenseView>& views,
                                      const ViewImageSource& images,
                                      const Arguments& arguments) {
  std::vector<std::size_t> kept;
  std::vector<DenseView> kept_views;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (v % arguments.every != 0) {
      kept.push_back(v);
      kept_views.push_back(views[v]);
    }
  }
  TM_ASSIGN_OR_RETURN(const SurfacePlan plan, plan_surface(kept_views, arguments.build, 0));
  WorkerPool executor(arguments.threads);
  const ChosenImages chosen(images, std::move(kept));
  return texture_surface(mesh, kept_views, chosen, plan.texture, executor);
}

Result<> run(const Arguments& arguments) {
  TM_ASSIGN_OR_RETURN(const Scene scene, read_model(arguments.result));
  TM_ASSIGN_OR_RETURN(
      const std::string ply,
      read_file(fs::path(arguments.result) / "model" / "mesh.ply", kMaxModelFileBytes));
  TM_ASSIGN_OR_RETURN(const TriangleMesh mesh, read_mesh_ply(ply));
  TM_ASSIGN_OR_RETURN(const PhotoSet photos,
                      open_photos(arguments.photos,
                                  Subfolders::kInclude,
                                  arguments.no_masks ? MaskUse::kIgnore : MaskUse::kUse));
  const std::vector<DenseView> views = dense_views(scene);
  TM_ASSIGN_OR_RETURN(const PhotoImages images, PhotoImages::create(photos, scene, views));
  TM_ASSIGN_OR_RETURN(const TextureResult made, texture_without(mesh, views, images, arguments));
  print_report(made.report);
  if (!arguments.output.empty()) {
    TM_RETURN_IF_ERROR(make_directory(arguments.output));
  }
  Totals totals;
  for (std::size_t v = 0; v < views.size(); v += arguments.every) {
    TM_ASSIGN_OR_RETURN(const ViewImage image, images.load(v));
    TM_ASSIGN_OR_RETURN(const ImageSimilarity similarity,
                        judge_view(made.textured, views[v], image.rgb, arguments.output));
    totals.add(similarity, static_cast<double>(image.rgb.total()));
  }
  totals.print();
  return {};
}

}  // namespace
}  // namespace trigmesh

int main(int argc, char** argv) {
  CLI::App app("Texture a mesh without every n-th photograph and compare with those");
  trigmesh::Arguments arguments;
  app.add_option("RESULT", arguments.result, "A result of trigmesh reconstruct")->required();
  app.add_option("PHOTOS", arguments.photos, "The photographs it was made of")->required();
  app.add_option("--output",
                 arguments.output,
                 "Folder for pictures: photograph, rendering, difference times four");
  app.add_option("--every", arguments.every, "Leave out views 0, n, 2n, ...")
      ->check(CLI::Range(2, 1000));
  app.add_option("--texture-size", arguments.build.texture_size_px, "Largest side of a page, px");
  app.add_option("--threads", arguments.threads)->check(CLI::Range(1, 64));
  app.add_flag("--no-masks", arguments.no_masks, "Do not use masks beside the photographs");
  CLI11_PARSE(app, argc, argv);
  const auto done = trigmesh::run(arguments);
  if (!done) {
    fmt::print(stderr, "error: {}\n", done.error().message);
    return 1;
  }
  return 0;
}
