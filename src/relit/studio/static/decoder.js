// @ts-check
/** Pictures that are decoded before they are seen, so that none flickers, and of which the newest wins. */

export class Decoder {
  constructor() {
    this.turn = 0;
  }

  /** Whatever is on its way comes too late. */
  cancel() {
    this.turn += 1;
  }

  /**
   * Decode a picture, several times over for several places; none, if another has been asked for meanwhile.
   * @param {Blob} blob @param {number} [copies]
   */
  async decode(blob, copies = 1) {
    const turn = (this.turn += 1);
    const pictures = Array.from({ length: copies }, () => {
      const picture = new Image();
      picture.src = URL.createObjectURL(blob);
      return picture;
    });
    try {
      await Promise.all(pictures.map((picture) => picture.decode()));
      if (turn === this.turn) return pictures;
    } catch (error) {
      // What has been overtaken need not be whole.
      if (turn === this.turn) throw error;
    }
    for (const picture of pictures) URL.revokeObjectURL(picture.src);
    return [];
  }
}
