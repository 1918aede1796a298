namespace rebounce {}
