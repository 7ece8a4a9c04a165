#include "sfm/texture/image_similarity.hpp"

#include <cmath>
#include <cstdint>

#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr int kWindow = 11;
constexpr double kSigma = 1.5;

cv::Mat grey_of(const cv::Mat& rgb) {
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  grey.convertTo(grey, CV_32F);
  return grey;
}

cv::Mat blur(const cv::Mat& image) {
  cv::Mat result;
  cv::GaussianBlur(
      image, result, cv::Size(kWindow, kWindow), kSigma, kSigma, cv::BORDER_REFLECT_101);
  return result;
}

cv::Mat ssim_map(const cv::Mat& a, const cv::Mat& b) {
  constexpr double kC1 = (0.01 * 255) * (0.01 * 255);
  constexpr double kC2 = (0.03 * 255) * (0.03 * 255);
  const cv::Mat mean_a = blur(a);
  const cv::Mat mean_b = blur(b);
  const cv::Mat var_a = blur(a.mul(a)) - mean_a.mul(mean_a);
  const cv::Mat var_b = blur(b.mul(b)) - mean_b.mul(mean_b);
  const cv::Mat covariance = blur(a.mul(b)) - mean_a.mul(mean_b);
  const cv::Mat top = (2.0 * mean_a.mul(mean_b) + kC1).mul(2.0 * covariance + kC2);
  const cv::Mat bottom =
      (mean_a.mul(mean_a) + mean_b.mul(mean_b) + kC1).mul(cv::Mat(var_a + var_b + kC2));
  return top / bottom;
}

}  // namespace

ImageSimilarity compare_images(const cv::Mat& image,
                               const cv::Mat& truth,
                               const cv::Mat& coverage) {
  TM_CHECK(image.size() == truth.size() && image.size() == coverage.size());
  TM_CHECK(image.type() == CV_8UC3 && truth.type() == CV_8UC3 && coverage.type() == CV_8UC1);
  ImageSimilarity result;
  double squared = 0.0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      if (coverage.at<std::uint8_t>(y, x) == 0) {
        continue;
      }
      const cv::Vec3i d =
          cv::Vec3i(image.at<cv::Vec3b>(y, x)) - cv::Vec3i(truth.at<cv::Vec3b>(y, x));
      squared += d.dot(d);
      ++result.pixel_count;
    }
  }
  if (result.pixel_count == 0) {
    return result;
  }
  const double mean = squared / (3.0 * static_cast<double>(result.pixel_count));
  result.psnr_db = mean > 0.0 ? std::min(100.0, 10.0 * std::log10(255.0 * 255.0 / mean)) : 100.0;
  cv::Mat whole;
  cv::erode(coverage, whole, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(kWindow, kWindow)));
  result.ssim = cv::countNonZero(whole) > 0
                    ? cv::mean(ssim_map(grey_of(image), grey_of(truth)), whole)[0]
                    : 0.0;
  return result;
}

}  // namespace trigmesh
