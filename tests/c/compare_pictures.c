/* A picture of pressed tissue is not empty and differs from the one at rest where the spatula
 * presses; one of operated tissue shows a wound.
 *
 *   compare_pictures REST.png PRESSED.png OPERATED.png
 */
#include <math.h>
#include <png.h>
#include <stdlib.h>

#include "expect.h"

static unsigned char *read_picture(const char *path, png_image *image) {
  unsigned char *pixels;
  memset(image, 0, sizeof *image);
  image->version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(image, path)) {
    fprintf(stderr, "%s: %s\n", path, image->message);
    exit(1);
  }
  image->format = PNG_FORMAT_RGB;
  pixels = malloc(PNG_IMAGE_SIZE(*image));
  if (pixels == NULL || !png_image_finish_read(image, NULL, pixels, 0, NULL)) {
    fprintf(stderr, "%s: %s\n", path, image->message);
    exit(1);
  }
  return pixels;
}

/* Tissue is warm: red stands clearly over blue. Background, metal and text are grey or blue. */
static int is_tissue(const unsigned char *pixel) { return pixel[0] > pixel[2] + 12; }

/* The inside of tissue is dark red. So is an end of the legend. */
static int is_inside(const unsigned char *pixel) {
  return pixel[0] > 40 && 2 * pixel[0] > 5 * pixel[1] && 2 * pixel[0] > 5 * pixel[2];
}

int main(int argc, char **argv) {
  png_image rest_image, pressed_image, operated_image;
  unsigned char *rest, *pressed, *operated;
  size_t i, count, tissue = 0, differing = 0, coloured_rest = 0, coloured_pressed = 0;
  size_t inside_rest = 0, inside_operated = 0;
  if (argc != 4) {
    return 2;
  }
  rest = read_picture(argv[1], &rest_image);
  pressed = read_picture(argv[2], &pressed_image);
  operated = read_picture(argv[3], &operated_image);
  EXPECT_TRUE(rest_image.width == pressed_image.width && rest_image.height == pressed_image.height);
  EXPECT_TRUE(rest_image.width == operated_image.width);
  EXPECT_TRUE(rest_image.height == operated_image.height);
  count = (size_t)rest_image.width * rest_image.height;
  /* Displaced tissue is yellow to red: at least twice as much red as blue. */
  for (i = 0; i < count && expect_failures == 0; i++) {
    const unsigned char *a = rest + 3 * i, *b = pressed + 3 * i;
    tissue += (size_t)is_tissue(a);
    differing += abs(a[0] - b[0]) + abs(a[1] - b[1]) + abs(a[2] - b[2]) > 60;
    coloured_rest += a[0] > 60 && a[0] > 2 * a[2] + 20;
    coloured_pressed += b[0] > 60 && b[0] > 2 * b[2] + 20;
    inside_rest += (size_t)is_inside(a);
    inside_operated += (size_t)is_inside(operated + 3 * i);
  }
  printf("tissue %.1f %%, differing %.2f %%, coloured by displacement: %lu pixels at rest, %lu "
         "pressed; inside: %lu at rest, %lu operated\n",
         100.0 * (double)tissue / (double)count, 100.0 * (double)differing / (double)count,
         (unsigned long)coloured_rest, (unsigned long)coloured_pressed, (unsigned long)inside_rest,
         (unsigned long)inside_operated);
  EXPECT_TRUE(tissue > count / 20);
  EXPECT_TRUE(differing > count / 500);
  EXPECT_TRUE(coloured_pressed > coloured_rest + 100);
  EXPECT_TRUE(inside_operated > inside_rest + 200);
  free(rest);
  free(pressed);
  free(operated);
  return expect_result("compare_pictures");
}
