import { defineConfig } from 'vite';
import { writeFileSync, mkdirSync, rmSync } from 'node:fs';
import { resolve } from 'node:path';

const DATA_TAG = '<script type="application/json" id="tendril-data"></script>';

/** Puts the bundle's script and style into the page itself, so that it opens by file:// and asks the network nothing. */
function onePage() {
  return {
    name: 'one-page',
    enforce: 'post',
    generateBundle(options, bundle) {
      const html = bundle['index.html'];
      let page = html.source;
      for (const item of Object.values(bundle)) {
        if (item.type === 'chunk') {
          // A function as replacement: "$&" in the code must stay what it is.
          const code = item.code.replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--');
          page = page.replace(/<script type="module"[^>]*src="[^"]*"[^>]*><\/script>/, '');
          page = page.replace('</body>', () => `<script type="module">${code}</script>\n</body>`);
        } else if (item.fileName.endsWith('.css')) {
          page = page.replace(/<link rel="stylesheet"[^>]*>/, () => `<style>${item.source}</style>`);
        } else if (item !== html) {
          this.error(`${item.fileName} would stand beside the page; import it as text instead`);
        }
      }
      if (page.split(DATA_TAG).length !== 2) this.error(`the page must hold ${DATA_TAG} exactly once`);
      if (/<(script|link|img)[^>]*\s(src|href)="(?!data:)/.test(page)) this.error('the page refers to another file');
      for (const name of Object.keys(bundle)) delete bundle[name];
      const folder = resolve(options.dir);
      rmSync(folder, { recursive: true, force: true });
      mkdirSync(folder, { recursive: true });
      writeFileSync(resolve(folder, 'page.html'), page);
    },
  };
}

export default defineConfig({
  base: './',
  build: { target: 'es2022', modulePreload: false, cssCodeSplit: false, assetsInlineLimit: 1e8, emptyOutDir: false,
    chunkSizeWarningLimit: 4000, reportCompressedSize: false },
  plugins: [onePage()],
});
